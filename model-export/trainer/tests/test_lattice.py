"""Fields at the nodes of cells, read at pixels."""

import numpy as np
import pytest

from papilla_trainer.errors import DatasetError
from papilla_trainer.lattice import Lattice, hats, quadratics

# Two cells of side 1 beside each other, the second halved along its rows.
PLACE = np.array([[1, 0, 0, 8, 8], [1, 0, 8, 4, 8], [1, 4, 8, 4, 8]])


def _cells() -> tuple[np.ndarray, np.ndarray]:
    """Nodes of each cell, and where each node lies."""
    at = {}
    nodes = np.zeros((len(PLACE), 9), dtype=np.int64)
    for cell, (_, row, column, rows, columns) in enumerate(PLACE):
        for n in range(9):
            key = (row + n // 3 * rows / 2, column + n % 3 * columns / 2)
            nodes[cell, n] = at.setdefault(key, len(at))
    return nodes, np.array(list(at))


def test_a_quadratic_field_is_read_exactly() -> None:
    nodes, at = _cells()
    place = np.array([[0.0, 0.0], [3.3, 5.1], [3.9, 8.0], [4.0, 9.5], [7.7, 15.0], [8.0, 16.0]])
    lattice = Lattice(np.ones(len(place), dtype=np.int64), place)

    def field(p: np.ndarray) -> np.ndarray:
        return 3.0 + p[:, 0] - 0.2 * p[:, 0] * p[:, 1] + 0.05 * p[:, 1] ** 2

    found, weights = lattice.read(PLACE, nodes, quadratics)
    assert np.allclose((field(at)[found] * weights).sum(axis=1), field(place), rtol=1e-5)


def test_pressure_is_linear_between_neighbouring_nodes() -> None:
    nodes, at = _cells()
    place = np.array([[2.0, 1.0], [4.0, 8.0], [1.0, 14.0]])
    found, weights = Lattice(np.ones(3, dtype=np.int64), place).read(PLACE, nodes, hats)
    peak = ((at == [4.0, 4.0]).all(axis=1)).astype(np.float64)
    # Half of the way along rows, a quarter along columns.
    assert np.allclose((peak[found] * weights).sum(axis=1), [0.125, 0.0, 0.0])
    assert np.allclose(weights.sum(axis=1), 1.0)


def test_a_pixel_beyond_all_cells_is_an_error() -> None:
    nodes, _ = _cells()
    beyond = Lattice(np.array([1, 2]), np.array([[9.5, 1.0], [1.0, 1.0]]))
    with pytest.raises(DatasetError, match="2 pixels lie in no cell"):
        beyond.read(PLACE, nodes, hats)
