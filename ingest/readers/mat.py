"""MATLAB `.mat`: version 5 (and its compressed form, 7) through scipy, 7.3 through HDF5."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions
from .contents import Array, Contents, lazy_array
from .hdf5 import hdf5_contents
from .hdf5_fields import HDF5_FIELDS
from .instrument_structures import INSTRUMENT_FIELDS, with_instrument_axes
from .mat5 import refuse_damaged, struct_arrays
from .recording import ArrayReader

#: MATLAB class, as scipy names it -> dtype of its numbers in MATLAB.
_DTYPES = {
    "double": "f8",
    "single": "f4",
    "logical": "?",
    **{
        f"{sign}int{8 * size}": f"{sign or 'i'}{size}"
        for sign in ("", "u")
        for size in (1, 2, 4, 8)
    },
}
_LONGEST_TEXT = 4096


class MatReader(ArrayReader):
    """Vectors, the columns of a matrix (`data_1`, or as campaign.toml names them) and the fields of
    structures.

    Numbers are in the class that MATLAB would show. A field is asked for by its name, or as
    `structure.field` where the name alone is not unique.
    """

    format = "mat"
    suffixes = (".mat",)
    fields = (*INSTRUMENT_FIELDS, *HDF5_FIELDS)

    def contents(self, path: Path, open_files: ExitStack, _: ReadingOptions) -> Contents:
        import h5py

        contents = (
            hdf5_contents(path, open_files)
            if h5py.is_hdf5(path)
            else _mat5_contents(path, refuse_damaged(path))
        )
        return with_instrument_axes(replace(contents, rules=self.fields))


def _mat5_contents(path: Path, complex_names: set[str]) -> Contents:
    from scipy.io import whosmat

    structures, texts_by_group = struct_arrays(path)
    listed = [
        (name, shape, kind) for name, shape, kind in whosmat(path) if not name.startswith("__")
    ]
    declared = [variable for variable in listed if variable[0] not in structures]
    texts = [
        n for n, shape, kind in declared if kind == "char" and 0 < np.prod(shape) <= _LONGEST_TEXT
    ]
    header = {name: " ".join(_load(path, name).reshape(-1)) for name in texts}
    kinds = {
        name: "complex" if name in complex_names else _DTYPES.get(kind, "O")
        for name, _, kind in declared
    }
    arrays = [
        Array(
            name,
            shape,
            np.dtype(kinds[name]),
            lazy_array(partial(_load, path, name)),
            obstacle=_class_obstacle(kind),
        )
        for name, shape, kind in declared
        if name not in texts
    ]
    arrays += [array for fields in structures.values() for array in fields]
    return Contents(arrays, header=header, statements={"": header, **texts_by_group})


def _class_obstacle(kind: str) -> str | None:
    """Why a variable of this class, as scipy names it, holds no samples; None where it may."""
    if kind in _DTYPES or kind == "char":
        return None if kind != "logical" else "is a logical array; save it with double(...)"
    if kind == "sparse":
        return "is a sparse matrix; save it with full(...)"
    named = {
        "opaque": "a MATLAB object (a table, timeseries, string, datetime or the like)",
        "object": "a MATLAB object",
    }
    return (
        f"is {named.get(kind, f'a MATLAB {kind}')}; save it with struct(...) or "
        f"as a vector of numbers"
    )


def _load(path: Path, name: str) -> NDArray[Any]:
    from scipy.io import loadmat

    # `mat_dtype`: MATLAB stores whole numbers of a double array as bytes, which scipy would hand on
    # as uint8.
    values: NDArray[Any] = loadmat(path, variable_names=[name], mat_dtype=True)[name]
    return values
