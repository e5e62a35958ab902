"""How near two configurations are: kernels over their factors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Distance between two words of a factor, where a number's whole range is 1.
_OTHER_WORD = 1.0


def squared_distances(factors: Sequence[Mapping[str, str | float]]) -> Floats:
    """(C, C): sum over the factors that vary; numbers by their share of the range, in logarithms where all are
    positive and span more than a factor of 3; words by being others."""
    names = sorted({name for row in factors for name in row})
    total = np.zeros((len(factors), len(factors)))
    for name in names:
        values = [row.get(name, "") for row in factors]
        if len(set(values)) > 1:
            total += _one(values)
    return total


def _one(values: Sequence[str | float]) -> Floats:
    if any(isinstance(value, str) for value in values):
        words = np.array([str(value) for value in values])
        return np.asarray(_OTHER_WORD * (words[:, None] != words[None, :]), dtype=np.float64)
    numbers = np.array(values, dtype=np.float64)
    if numbers.min() > 0 and numbers.max() > 3 * numbers.min():
        numbers = np.log(numbers)
    numbers = (numbers - numbers.min()) / np.ptp(numbers)
    return np.asarray((numbers[:, None] - numbers[None, :]) ** 2)


def each_level(factors: Sequence[Mapping[str, str | float]]) -> list[NDArray[np.bool_]]:
    """(C,) each: the configurations of one level of one factor; two at least, and two others."""
    found: dict[bytes, NDArray[np.bool_]] = {}
    for name in sorted({name for row in factors for name in row}):
        values = [row.get(name, "") for row in factors]
        for level in dict.fromkeys(values):
            inside = np.array([value == level for value in values])
            if 2 <= inside.sum() <= len(values) - 2:
                found.setdefault(inside.tobytes(), inside)
    return list(found.values())


#: Half of the variance of what is smooth is the same everywhere: with many words among the factors nothing else would
#: hold that a sensor reads 2 % high in all configurations.
_EVERYWHERE = 0.5


def smooth(distance: Floats, length: float) -> Floats:
    """(C, C) kernel of variance 1: half of it a constant, half `varying`."""
    return _EVERYWHERE + (1 - _EVERYWHERE) * varying(distance, length)


def varying(distance: Floats, length: float) -> Floats:
    """(C, C) squared-exponential kernel of so long a range, of `squared_distances`."""
    return np.asarray(np.exp(-0.5 * distance / length**2))
