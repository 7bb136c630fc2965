"""What training minimises.

``mse`` is the U-Net paper's: the mean square of max-normalised maps. It hardly sees a shallow
indentation, whose greatest SED is 4 to 5 % of the dataset's maximum (plates, 0.25 mm), nor the far
field of a deep one. ``relative`` is the measure that a model is judged by: each sample's squared
error over its own squared norm, and the same once more over the far field alone.
"""

from __future__ import annotations

from collections.abc import Callable

import torch
from torch import Tensor, nn

LOSSES = ("mse", "relative")

# The far field is where SED is below this part of a sample's maximum.
_FAR_FIELD = 0.1

Loss = Callable[[Tensor, Tensor], Tensor]

# A far field that is next to nothing beside the sample must not dominate the mean: this part of
# the sample's own norm is added to the far field's.
_FAR_FLOOR = 1e-4


def make_loss(name: str, weights: Tensor, far_weight: float) -> Loss:
    """``weights``: what each value of a sample counts, shaped like one sample."""
    if name == "mse":
        return nn.functional.mse_loss
    flat = weights.reshape(1, -1)
    return lambda output, target: relative_loss(
        output.flatten(1), target.flatten(1), flat, far_weight
    )


def relative_loss(output: Tensor, target: Tensor, weights: Tensor, far_weight: float) -> Tensor:
    """Mean over samples ``[N, M]`` of squared relative L2 and ``far_weight`` x the far field's.

    A sample without SED counts nothing.
    """
    squared = weights * (output - target) ** 2
    norm = (weights * target**2).sum(dim=1)
    peak = (target * (weights > 0)).amax(dim=1, keepdim=True)
    far = weights * (target < _FAR_FIELD * peak)
    far_norm = (far * target**2).sum(dim=1) + _FAR_FLOOR * norm
    tiny = torch.finfo(target.dtype).tiny
    whole = squared.sum(dim=1) / norm.clamp_min(tiny)
    distant = ((output - target) ** 2 * far).sum(dim=1) / far_norm.clamp_min(tiny)
    return torch.where(norm > 0, whole + far_weight * distant, torch.zeros_like(norm)).mean()
