"""What a run trains: the network, its samples and its loss."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from papilla_trainer.comparison.unet import NetworkSpec, S1UNet, build_network
from papilla_trainer.config import TrainConfig
from papilla_trainer.contact_maps import with_contact
from papilla_trainer.dataset import Dataset, Maps
from papilla_trainer.joined import STRIDE
from papilla_trainer.losses import Loss, make_loss
from papilla_trainer.map_network import MapNet, MapSpec


@dataclass(frozen=True)
class Samples:
    """On the device: maps ``[N, 1, 224, 224]``, in Pa and J/m3.

    The U-Net's are divided by the dataset's maxima, as in its paper. ``source`` ``[N]``, on the
    CPU, says which dataset each is of; with contact's pressure it counts as another.
    """

    inputs: Tensor
    targets: Tensor
    source: Tensor

    @staticmethod
    def of(maps: Maps, device: torch.device, units: tuple[float, float] = (1.0, 1.0)) -> Samples:
        """Maps in units of so many Pa and J/m3."""
        inputs = torch.from_numpy(maps.pressure_pa).unsqueeze(1).mul_(1 / units[0])
        targets = torch.from_numpy(maps.sed_j_per_m3).unsqueeze(1).mul_(1 / units[1])
        return Samples(inputs.to(device), targets.to(device), source_of(maps.press_id))

    def __len__(self) -> int:
        return self.inputs.shape[0]


@dataclass(frozen=True)
class Task:
    """All that the training loop has to know."""

    network: nn.Module
    fit: Samples
    validation: Samples | None
    loss: Loss


def make_task(
    dataset: Dataset,
    config: TrainConfig,
    fit_ids: list[int],
    validation_ids: list[int],
    device: torch.device,
) -> Task:
    """Load the indentations named, and no others, and build the network."""
    spec = config.spec
    load = _loader(spec)
    if config.contact:
        maps = dataset.load(fit_ids)
        fit = Samples.of(with_contact(maps, dataset, config.contact), device)
        fit.source[len(maps) :] += len(dataset.hashes)
    else:
        fit = load(dataset, fit_ids, device)
    validation = load(dataset, validation_ids, device) if validation_ids else None
    network = fresh_network(spec, config.seed).to(memory_format=torch.channels_last)
    weights = torch.from_numpy(dataset.interface.mask())
    loss = make_loss(config.loss_name, weights.to(device), config.far_weight)
    return Task(network.to(device), fit, validation, loss)


def fresh_network(spec: NetworkSpec | MapSpec, seed: int) -> nn.Module:
    """A network on maps; the same seed gives the same weights."""
    if isinstance(spec, NetworkSpec):
        return build_network(spec, seed)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return MapNet(spec)


def trained_network(
    spec: NetworkSpec | MapSpec, weights: dict[str, Tensor]
) -> nn.Module:
    """A network that holds these weights."""
    network: nn.Module = MapNet(spec) if isinstance(spec, MapSpec) else S1UNet(spec.base)
    network.load_state_dict(weights)
    return network


def _loader(
    spec: NetworkSpec | MapSpec,
) -> Callable[[Dataset, list[int], torch.device], Samples]:
    return _load_normalised if isinstance(spec, NetworkSpec) else _load_maps


def _load_normalised(dataset: Dataset, ids: list[int], device: torch.device) -> Samples:
    units = (dataset.pressure_max_pa, dataset.sed_max_j_per_m3)
    return Samples.of(dataset.load(ids), device, units)


def _load_maps(dataset: Dataset, ids: list[int], device: torch.device) -> Samples:
    return Samples.of(dataset.load(ids), device)


def source_of(press_id: NDArray[np.int64]) -> Tensor:
    """``[N]``: the dataset, of those joined, that each press is of."""
    return torch.from_numpy(press_id // STRIDE)
