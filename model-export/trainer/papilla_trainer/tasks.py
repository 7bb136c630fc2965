"""What a run trains: the network, its samples and its loss."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor, nn

from papilla_trainer.comparison.unet import NetworkSpec, S1UNet, build_network
from papilla_trainer.config import TrainConfig
from papilla_trainer.contact_maps import with_contact
from papilla_trainer.dataset import Dataset, State
from papilla_trainer.errors import UsageError
from papilla_trainer.joined import STRIDE
from papilla_trainer.losses import Loss, make_loss
from papilla_trainer.map_network import MapNet, MapSpec
from papilla_trainer.pseudo_labels import pseudo_states

# Where pseudo-labels come from, as ``Samples.source`` has it.
PSEUDO = -1


class Samples:
    """What is trained on: maps ``[N, 1, 224, 224]``, in Pa and J/m3, taken a batch at a time.

    On a CPU they stay where they are on disk, mapped into memory; another device gets all of them
    at once. The U-Net's are divided by the dataset's maxima, as in its paper. ``source`` ``[N]``
    says which dataset each is of; with contact's pressure it counts as another, and pseudo-labels
    are of :data:`PSEUDO`.
    """

    def __init__(
        self,
        states: list[State],
        device: torch.device,
        units: tuple[float, float] = (1.0, 1.0),
    ) -> None:
        """Maps in units of so many Pa and J/m3."""
        self.source = torch.tensor([state.press_id // STRIDE for state in states])
        self._states, self._units = states, units
        self._held = None
        if device.type != "cpu":
            inputs, targets = self._read(range(len(states)))
            self._held = inputs.to(device), targets.to(device)

    def __len__(self) -> int:
        return len(self._states)

    def batch(self, chosen: Tensor) -> tuple[Tensor, Tensor]:
        """Inputs and targets of the samples chosen, on the device."""
        if self._held is None:
            return self._read(chosen.tolist())
        inputs, targets = self._held
        chosen = chosen.to(inputs.device)
        return inputs[chosen], targets[chosen]

    def most(self, config: TrainConfig) -> dict[int, int | None]:
        """How many samples of each source an epoch sees."""
        most = dict.fromkeys(self.source.unique().tolist(), config.dataset_samples)
        if PSEUDO in most:
            most[PSEUDO] = config.pseudo_samples
        return most

    def _read(self, rows: Iterable[int]) -> tuple[Tensor, Tensor]:
        states = [self._states[row] for row in rows]
        maps = ([s.pressure_pa for s in states], [s.sed_j_per_m3 for s in states])
        inputs, targets = (
            torch.from_numpy(np.stack(of)).unsqueeze(1).mul_(1 / unit)
            for of, unit in zip(maps, self._units, strict=True)
        )
        return inputs, targets


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
    spec, units = config.spec, (1.0, 1.0)
    if isinstance(spec, NetworkSpec):
        units = (dataset.pressure_max_pa, dataset.sed_max_j_per_m3)
    states = dataset.states(fit_ids)
    simulated = with_contact(states, dataset, config.contact)
    if config.contact_alone:
        simulated, states = simulated[len(states) :], []
        if not simulated:
            raise UsageError("--contact-alone: no state of the training is in the --contact files")
    pseudo = pseudo_states(config.pseudo_labels, dataset)
    fit = Samples(simulated + pseudo, device, units)
    fit.source[len(states) : len(simulated)] += len(dataset.hashes)
    fit.source[len(simulated) :] = PSEUDO
    aside = dataset.states(validation_ids)
    validation = Samples(aside, device, units) if aside else None
    network = fresh_network(spec, config.seed).to(memory_format=torch.channels_last)
    weights = torch.from_numpy(dataset.mask())
    loss = make_loss(config.loss_name, weights.to(device), config.far_weight)
    return Task(network.to(device), fit, validation, loss)


def fresh_network(spec: NetworkSpec | MapSpec, seed: int) -> nn.Module:
    """A network on maps; the same seed gives the same weights."""
    if isinstance(spec, NetworkSpec):
        return build_network(spec, seed)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        return MapNet(spec)


def trained_network(spec: NetworkSpec | MapSpec, weights: dict[str, Tensor]) -> nn.Module:
    """A network that holds these weights."""
    network: nn.Module = MapNet(spec) if isinstance(spec, MapSpec) else S1UNet(spec.base)
    network.load_state_dict(weights)
    return network
