"""Arrays of an .npy that are read from its file each time."""

from pathlib import Path

import numpy as np
import pytest

from sd2core.io.radar.stored_arrays import stored_npy


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("rows", [slice(1, 3), slice(2, 2), slice(0, None)])
def test_rows_alone_may_be_asked_for_in_either_order(
    tmp_path: Path, order: str, rows: slice
) -> None:
    """Rows asked of a Fortran .npy were those of its last axis; none at all raised ValueError."""
    array = np.arange(5 * 3 * 4, dtype=np.uint16).reshape(5, 3, 4)
    np.save(tmp_path / "a.npy", np.asarray(array, order=order))
    stored = stored_npy(tmp_path / "a.npy", "numbers")
    np.testing.assert_array_equal(stored.read((rows,)), array[rows])
