"""Classes of MATLAB 7.3: which data sets hold the numbers of a variable, and which hold handles,
bits or non-zeros."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .base import RecordingError, refuse_bomb
from .contents import Array, in_memory, to_python

if TYPE_CHECKING:
    import h5py

_NUMBERS = frozenset(
    {
        "double",
        "single",
        "char",
        "struct",
        *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
    }
)
#: `MATLAB_object_decode` of handles to objects, and those of `MATLAB_int_decode` that are no
#: numbers.
_WORDS = {
    "cell": "a cell array",
    "logical": "a logical array",
    "function_handle": "a function handle",
}


def matlab_obstacle(dataset: h5py.Dataset) -> str | None:
    """Why the numbers of a data set are no samples by its MATLAB class, or by that of a structure
    around it; None where they are."""
    item: Any = dataset
    while item.name != "/":
        kind = item.attrs.get("MATLAB_class")
        name = None if kind is None else str(to_python(kind))
        if name is not None and (name not in _NUMBERS or "MATLAB_object_decode" in item.attrs):
            place = item.name.rpartition("/")[2]
            what = _WORDS.get(name, f"a MATLAB {name}")
            cure = (
                "save it with double(...)"
                if name == "logical"
                else "save it with struct(...) or as a vector of numbers"
            )
            return (
                f"is {what}; {cure}"
                if item is dataset
                else f"belongs to {place!r}, which is {what}; {cure}"
            )
        if "MATLAB_object_decode" in item.attrs:
            return "is a MATLAB object; save it with struct(...) or as a vector of numbers"
        item = item.parent
    return None


def sparse_vector(path: Path, group: h5py.Group) -> Array:
    """A sparse matrix with its zeros: `data` at the rows `ir` of the columns that `jc` bounds.

    Raises `RecordingError` for a matrix that does not hold what it declares.
    """
    place, _, name = group.name.lstrip("/").rpartition("/")
    kind = str(to_python(group.attrs.get("MATLAB_class", "double")))
    if kind != "double":
        return in_memory(
            name,
            np.empty(0),
            group=place,
            obstacle=f"is a sparse {kind} matrix; save it with full(...)",
        )
    rows = int(group.attrs["MATLAB_sparse"])
    ends = (
        np.asarray(group["jc"][()]).reshape(-1).astype(np.int64)
        if "jc" in group
        else np.zeros(1, np.int64)
    )
    columns = ends.size - 1
    refuse_bomb(path, name, rows * columns, 8)
    shape = (columns, rows)  # as HDF5 holds a full matrix
    stored = np.asarray(group["data"][()]).reshape(-1) if "data" in group else np.empty(0)
    at = (
        np.asarray(group["ir"][()]).reshape(-1).astype(np.int64)
        if "ir" in group
        else np.empty(0, np.int64)
    )
    counts = np.diff(ends)
    whole = stored.size == at.size == int(counts.sum()) and not np.any(counts < 0)
    if not whole or np.any((at < 0) | (at >= rows)) or stored.dtype.kind not in "iuf":
        raise RecordingError(
            f"{path.name}: the sparse {name!r} does not hold what it declares; it is damaged"
        )
    full: NDArray[np.float64] = np.zeros(rows * columns)
    full[np.repeat(np.arange(columns), counts) * rows + at] = stored
    return in_memory(name, full.reshape(shape), group=place)
