"""Columns of a matrix, each an array of its own: named as the laboratory says, else `NAME_1`, `NAME_2`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import RecordingError, refuse_bomb
from .contents import Array, name_and_unit

#: A matrix with more channels than this is no recording of a bench.
MAX_COLUMNS = 1024


def with_columns(path: Path, arrays: Sequence[Array], names: Sequence[str]) -> list[Array]:
    """`arrays` with every matrix in columns; a column named "" is left out.

    `names` are those of the matrix that has as many columns, or of the array that has no name.

    Samples run along the longer side, or across the side that has as many as there are names. Raises `RecordingError`
    where that is open.
    """
    fitting = [array for array in arrays if names and _fits(array, len(names))]
    if len(fitting) > 1:
        listed = ", ".join(repr(array.name) for array in fitting)
        raise RecordingError(
            f"{path.name}: {len(names)} columns are named, and {listed} have as many; expected one matrix"
        )
    columns: list[Array] = []
    for array in arrays:
        if names and array.nameless and array not in fitting:
            raise RecordingError(
                f"{path.name}: {len(names)} columns are named ({', '.join(names)}), and its shape is {array.shape}; "
                "expected as many names as columns"
            )
        columns += _columns(path, array, names if array in fitting else ())
    return columns


def _sides(array: Array) -> tuple[int, ...]:
    return tuple(length for length in array.shape if length != 1)


def _is_matrix(array: Array) -> bool:
    sides = _sides(array)
    return len(sides) == 2 and min(sides) > 0 and array.dtype.kind in "iuf" and array.dtype.itemsize <= 8


def _fits(array: Array, count: int) -> bool:
    if _is_matrix(array):
        return count in _sides(array)
    return array.nameless and count == 1 and len(_sides(array)) < 2


def _columns(path: Path, array: Array, names: Sequence[str]) -> list[Array]:
    if not _is_matrix(array):
        return [_renamed(array, names[0])] if names else [array]
    rows, columns = _sides(array)
    if rows == columns:
        if names or array.nameless:
            raise RecordingError(
                f"{path.name}: {array.name!r} has shape {array.shape}; expected more samples than channels"
            )
        return [array]  # and refused when asked for: a calibration, perhaps
    across = columns < rows if not names else columns == len(names)
    count = columns if across else rows
    if count > MAX_COLUMNS:
        raise RecordingError(f"{path.name}: {array.name!r} has {count} columns; expected at most {MAX_COLUMNS}")
    refuse_bomb(path, array.name, array.samples, array.dtype.itemsize)

    @cache
    def whole() -> NDArray[Any]:
        values = array.take(0, array.samples).reshape(rows, columns)
        return np.ascontiguousarray(values.T) if across else values

    labels = names or [f"{array.name}_{number + 1}" for number in range(count)]
    length = rows if across else columns

    def column(number: int, label: str) -> Array:
        def take(start: int, stop: int) -> NDArray[Any]:
            if whole().shape != (count, length):
                raise RecordingError(f"{path.name}: {array.name!r} does not hold what it declares; it is damaged")
            return whole()[number, start:stop].copy()

        return _renamed(replace(array, shape=(length,), take=take), label)

    return [column(number, label) for number, label in enumerate(labels) if label]


def _renamed(array: Array, label: str) -> Array:
    name, unit = name_and_unit(label)
    return replace(array, name=name, unit=unit or array.unit)
