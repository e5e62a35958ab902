"""Errors of a simulator that no effect explains: small ones of all simulators, and those in
proportion to an effect.

The background is within tolerance and the same for every set of effects (Kennedy and O'Hagan, J. R.
Stat. Soc. B 63 (2001) 425). One kernel met with a rougher background than it assumes raises false
alarms, hence a bank of them. The discrepancy of a law is a Gaussian process over the factors whose
amplitude is a share of what the effect does: a law that is wrong by a third is still that effect's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..observables.base import Observable


@dataclass(frozen=True)
class ModelErrorAmplitudes:
    """Amplitudes in tolerances: the same everywhere, smooth over the factors, white over
    configurations.

    Of `detail` of them where an observable is a detail of shape or timing. `gain`: smooth and
    white, what all lines of an accelerometer share as its coupling and its place differ from one
    configuration to the next.
    """

    constant: float
    smooth: float = 0.0
    white: float = 0.0
    detail: float = 1.0
    gain: tuple[float, float] = (0.0, 0.0)


_FINE = 0.15
_SIZES = (
    (0.5, 0.0, 0.0),
    (1.0, 0.0, 0.0),
    (0.0, 0.5, 0.0),
    (0.0, 0.0, 0.4),
    (0.5, 0.3, 0.2),
    (1.0, 0.5, 0.3),
    (0.5, 0.5, 0.8),
)
_NONE, _MIDDLE = ModelErrorAmplitudes(0.0), ModelErrorAmplitudes(0.5, 0.3, 0.2)
_ROUGH = ModelErrorAmplitudes(0.5, 0.5, 0.8, _FINE)
#: Their largest amplitude is about the tolerance itself: a gap of that size is none.
BANK = (
    _NONE,
    *(ModelErrorAmplitudes(*sizes, detail=detail) for detail in (1.0, _FINE) for sizes in _SIZES),
)
_LITTLE, _SOME, _MUCH = (0.3, 0.2), (0.5, 0.5), (0.8, 0.6)
#: A plate's modes are off by the same in all configurations; from one to the next its sensors are.
PLATE_BANK = (
    _NONE,
    *(
        ModelErrorAmplitudes(constant, detail=_FINE, gain=gain)
        for constant, gain in ((0.25, _LITTLE), (0.5, _LITTLE), (0.5, _SOME), (0.8, _SOME))
    ),
    *(
        ModelErrorAmplitudes(constant, detail=_FINE, gain=gain)
        for constant, gain in ((0.25, _SOME), (0.8, _LITTLE), (1.0, _MUCH))
    ),
    *(
        ModelErrorAmplitudes(constant, gain=gain)
        for constant, gain in ((0.25, _LITTLE), (0.5, _LITTLE), (0.8, _SOME))
    ),
    ModelErrorAmplitudes(0.5),
    _MIDDLE,
    replace(_MIDDLE, detail=_FINE),
    _ROUGH,
)

#: Range of what is smooth over factors scaled to [0, 1], and over frequency in octaves.
LENGTH, OCTAVES = 0.8, 0.7
#: How much of the variance neighbouring observables share; what has parts has so much beside them.
SHARED, OWN = 0.5, 0.1
#: Of a law's discrepancy: the share of its variance that all configurations have in common, that is
#: smooth over the factors, and that levels of factors have of their own.
_DISCREPANCY = (0.2, 0.4, 0.4)
#: Share of it that all observables have in common.
_TOGETHER = 0.3
#: Share of the same that is not the same in two configurations, however alike.
_OWN_CELL = 0.02


def squared_distances(factors: Sequence[Mapping[str, str | float]]) -> Floats:
    """(C, C): sum over the factors that vary; numbers by their share of the range, in logarithms
    where all are positive and span more than a factor of 3; words by being others."""
    names = sorted({name for row in factors for name in row})
    total = np.zeros((len(factors), len(factors)))
    for name in names:
        values = [row.get(name, "") for row in factors]
        if len(set(values)) > 1:
            total += _squared_distance(values)
    return total


def _squared_distance(values: Sequence[str | float]) -> Floats:
    if any(isinstance(value, str) for value in values):
        words = np.array([str(value) for value in values])
        return np.asarray(words[:, None] != words[None, :], dtype=np.float64)
    numbers = np.array(values, dtype=np.float64)
    if numbers.min() > 0 and numbers.max() > 3 * numbers.min():
        numbers = np.log(numbers)
    numbers = (numbers - numbers.min()) / np.ptp(numbers)
    return np.asarray((numbers[:, None] - numbers[None, :]) ** 2)


def same_levels(factors: Sequence[Mapping[str, str | float]]) -> Floats:
    """(C, C): the share of the factors that vary in which two configurations are the same; 1 where
    none varies."""
    names = sorted({name for row in factors for name in row})
    columns = [[row.get(name, "") for row in factors] for name in names]
    varying = [
        np.array([str(value) for value in column]) for column in columns if len(set(column)) > 1
    ]
    if not varying:
        return np.ones((len(factors), len(factors)))
    return np.asarray(np.mean([column[:, None] == column[None, :] for column in varying], axis=0))


def observable_kernel(observables: Sequence[Observable]) -> Floats:
    """(D, D): one on the diagonal; part of it shared within a channel, by octaves where there are
    frequencies. What is made of parts has the errors of these, and a little of its own."""
    channel = np.array([f"{item.stage} {item.channel}" for item in observables])
    octave = octaves(observables)
    apart = octave[:, None] - octave[None, :]
    near = np.where(np.isnan(apart), 0.0, np.exp(-0.5 * (np.nan_to_num(apart) / OCTAVES) ** 2))
    alike = channel[:, None] == channel[None, :]
    parts = [set(item.parts) for item in observables]
    made = np.array([[len(a & b) for b in parts] for a in parts], dtype=np.float64) * alike
    own = np.where(np.diag(made) > 0, np.diag(made) + OWN, 1.0)
    return np.asarray(np.where(np.eye(len(channel), dtype=bool), own, SHARED * near * alike + made))


def octaves(observables: Sequence[Observable]) -> Floats:
    """(D,): logarithms of the frequencies to the base of 2, NaN where there is none."""
    return np.array(
        [
            np.nan if item.frequency_hz is None else np.log2(item.frequency_hz)
            for item in observables
        ]
    )


@dataclass(frozen=True, eq=False)
class ErrorKernels:
    """Kernels between the N cells of one stage; a cell is one observable in one configuration."""

    constant: Floats
    smooth: Floats
    white: Floats
    level: Floats
    observables: Floats
    lines: Floats  # 1 between lines and amplitudes of one channel of a spectrum
    detail: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        factors: Sequence[Mapping[str, str | float]],
        observables: Sequence[Observable],
        configuration: NDArray[np.intp],
        observable: NDArray[np.intp],
    ) -> ErrorKernels:
        """`factors` of C configurations; `configuration` and `observable` (N,) of the cells."""
        pair = np.ix_(configuration, configuration)
        distance = squared_distances(factors)
        channel = np.array([item.channel for item in observables])
        spectra = {item.channel for item in observables if item.unit == "dB"}
        level = np.isfinite(octaves(observables)) & np.array(
            [item.channel in spectra for item in observables]
        )
        lines = level[:, None] & level[None, :] & (channel[:, None] == channel[None, :])
        cells = np.ix_(observable, observable)
        return cls(
            np.ones((len(configuration), len(configuration))),
            np.exp(-0.5 * distance / LENGTH**2)[pair],
            np.eye(len(factors))[pair],
            same_levels(factors)[pair],
            observable_kernel(observables)[cells],
            lines.astype(np.float64)[cells],
            np.array([item.detail for item in observables])[observable],
        )

    def background(self, member: ModelErrorAmplitudes) -> Floats:
        """(N, N)"""
        share = np.where(self.detail, member.detail, 1.0)
        over = (
            member.constant**2 * self.constant
            + member.smooth**2 * self.smooth
            + member.white**2 * self.white
        )
        gain = member.gain[0] ** 2 * self.smooth + member.gain[1] ** 2 * self.white
        return np.asarray(over * self.observables * np.outer(share, share) + gain * self.lines)

    def discrepancy(self) -> Floats:
        """(N, N): correlation of a law's relative errors between cells."""
        together, smooth, level = _DISCREPANCY
        over = together * self.constant + smooth * self.smooth + level * self.level
        own = self.observables / np.sqrt(
            np.outer(np.diag(self.observables), np.diag(self.observables))
        )
        between = _TOGETHER + (1 - _TOGETHER) * own
        return np.asarray((1 - _OWN_CELL) * over * between + _OWN_CELL * np.eye(len(over)))


def bank(stage: str) -> tuple[ModelErrorAmplitudes, ...]:
    return PLATE_BANK if stage == "plate" else BANK


def usual_background(stage: str) -> int:
    """Its place in the bank: within tolerance, partly constant, partly smooth, and a little from
    one configuration to the next."""
    return bank(stage).index(_MIDDLE)
