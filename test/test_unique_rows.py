"""The different rows are those of numpy."""

import numpy as np
import pytest

from trajectory_guard.shapes.unique_rows import unique_rows


@pytest.mark.parametrize('count', [1, 2, 50, 3000])
@pytest.mark.parametrize('columns', [1, 3])
def test_agrees_with_numpy(count: int, columns: int) -> None:
    rng = np.random.default_rng([count, columns])
    rows = rng.integers(-3, 4, (count, columns)) * rng.choice([0.1, 1.0, 1e-300], (count, columns))
    unique, place = unique_rows(rows)
    expected, inverse = np.unique(rows, axis=0, return_inverse=True)
    assert np.array_equal(unique, expected)
    assert np.array_equal(place, inverse.reshape(-1))
    assert np.array_equal(unique[place], rows)


def test_zeros_of_either_sign_are_equal() -> None:
    unique, place = unique_rows(np.array([[0.0, 1.0], [-0.0, 1.0], [0.0, -1.0]]))
    assert unique.tolist() == [[0.0, -1.0], [0.0, 1.0]]
    assert place.tolist() == [1, 1, 0]


def test_no_rows() -> None:
    unique, place = unique_rows(np.empty((0, 3)))
    assert unique.shape == (0, 3)
    assert place.shape == (0,)
