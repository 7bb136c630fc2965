"""Fields on cells, read at pixels."""

import numpy as np
import pytest

from papilla_trainer.errors import DatasetError
from papilla_trainer.lattice import Lattice

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

    found, weights = lattice.at_nodes(PLACE, nodes)
    assert np.allclose((field(at)[found] * weights).sum(axis=1), field(place), rtol=1e-5)


def test_a_linear_pressure_is_read_off_its_gauss_points_exactly() -> None:
    place = np.array([[1.0, 1.0], [3.3, 5.1], [2.0, 9.5], [7.0, 14.0], [8.0, 16.0]])
    lattice = Lattice(np.ones(len(place), dtype=np.int64), place)
    # The points of each cell, row by row.
    root = np.array([-1.0, 0.0, 1.0]) * 0.6**0.5
    xi = np.stack(np.meshgrid(root, root, indexing="ij"), axis=2).reshape(9, 2)
    at = np.concatenate([cell[1:3] + cell[3:5] * (1.0 + xi) / 2.0 for cell in PLACE])

    def field(p: np.ndarray) -> np.ndarray:
        return 3.0 + p[:, 0] - 0.2 * p[:, 0] * p[:, 1]

    found, weights = lattice.at_gauss_points(PLACE)
    read = (field(at)[found] * weights).sum(axis=1)
    assert np.allclose(read[:-1], field(place[:-1]), rtol=1e-5)
    # Beyond the outermost point it is what it is there.
    assert np.isclose(read[-1], field(at)[9 * 2 + 8])


def test_a_pixel_beyond_all_cells_is_an_error() -> None:
    nodes, _ = _cells()
    beyond = Lattice(np.array([1, 2]), np.array([[9.5, 1.0], [1.0, 1.0]]))
    with pytest.raises(DatasetError, match="2 pixels lie in no cell"):
        beyond.at_nodes(PLACE, nodes)
