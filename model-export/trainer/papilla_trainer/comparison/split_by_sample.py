"""A dataset whose states are shared out one by one, as the U-Net paper seems to have done.

The states of one simulation resemble each other, so that a network which is tested on one of them
has learnt from its neighbours. What is shipped is therefore tested on whole simulations. This view
is here to measure what the other split hides.
"""

from __future__ import annotations

import numpy as np

from papilla_trainer.dataset import Dataset, Press, State, View


class SplitBySample(View):
    """As many states for testing as ``whole`` has, drawn by lot. Press 7 is the state in row 7."""

    def __init__(self, whole: Dataset, seed: int) -> None:
        super().__init__(whole)
        states = sum(press.samples for press in whole.presses.values())
        tests = sum(whole.presses[i].samples for i in whole.test_ids)
        self.presses = {row: Press(row, 1) for row in range(states)}
        order = np.random.default_rng([seed, 0x5A3B]).permutation(states).tolist()
        self.test_ids, self.train_ids = sorted(order[:tests]), sorted(order[tests:])

    def states(self, ids: list[int]) -> list[State]:
        """The states in these rows."""
        maps = self.drawn
        return [
            State(
                maps.pressure_pa[row],
                maps.sed_j_per_m3[row],
                row,
                int(maps.state[row]),
                float(maps.depth_mm[row]),
            )
            for row in ids
        ]
