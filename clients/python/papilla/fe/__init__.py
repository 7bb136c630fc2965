"""Finite elements in this process: what `fe-datagen` solves.

- `Scene`: one simulation, explained and solved state by state
- `Campaign`: many simulations, solved into a dataset that can be gone on with
- `Dataset`: the states of a campaign as arrays

`for state in papilla.fe.Scene("scenes/flat-press.toml").solve(): print(state.depth_mm, state.force_n)`
"""

from .campaigns import Campaign, Report
from .datasets import Dataset
from .scenes import COMPONENTS, Effect, Scene, Solve, State
from .source import Explanation

__all__ = [
    "COMPONENTS",
    "Campaign",
    "Dataset",
    "Effect",
    "Explanation",
    "Report",
    "Scene",
    "Solve",
    "State",
]
