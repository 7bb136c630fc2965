"""Fields at the nodes of cells, read at pixels."""

import numpy as np
import pytest

from papilla_trainer.errors import DatasetError
from papilla_trainer.lattice import SIDE_PX, Lattice, hats, quadratics

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


def test_a_cell_far_from_the_finger_is_refused_before_memory_is_taken() -> None:
    nodes, _ = _cells()
    astray = PLACE.copy()
    astray[2, 1:3] = 65_000
    lattice = Lattice(np.ones(1, dtype=np.int64), np.array([[1.0, 1.0]]))
    with pytest.raises(DatasetError, match="65005 by 65009 squares"):
        lattice.read(astray, nodes, hats)


def test_points_fill_a_pixel_and_stay_on_the_lattice() -> None:
    """The numbers of ``papilla_dataset``'s test: both read pressure at the same points."""
    row, column = np.divmod(np.arange(SIDE_PX**2), SIDE_PX)
    inside = np.flatnonzero((row >= 20) & (row < 204) & (column >= 20) & (column < 204))
    place = np.stack([8.0 * row[inside], 4.0 * column[inside]], axis=1)
    side = np.ones(len(inside), dtype=np.int64)
    at = Lattice(side, place).within(inside).place.reshape(-1, len(inside), 2)
    middle = int(np.searchsorted(inside, 100 * SIDE_PX + 90))
    assert at.shape == (16, len(inside), 2)
    assert at[[0, 15], middle].tolist() == [[797.0, 358.5], [803.0, 361.5]]
    assert (at[[0, 15], 0] - place[0]).tolist() == [[0.0, 0.0], [3.0, 1.5]]

    right = (column[inside] > 90).astype(np.int64)
    at = Lattice(right, place / [8, 4]).within(inside).place.reshape(-1, len(inside), 2)
    assert at[:4, middle, 1].tolist() == [89.625, 89.875, 90.0, 90.0]


def test_a_pixel_beyond_all_cells_is_an_error() -> None:
    nodes, _ = _cells()
    beyond = Lattice(np.array([1, 2]), np.array([[9.5, 1.0], [1.0, 1.0]]))
    with pytest.raises(DatasetError, match="2 pixels lie in no cell"):
        beyond.read(PLACE, nodes, hats)
