"""Families of observables: how large the error of each is, and how likely it is that a simulator's
background makes it.

`none` is said of all of them: a damping ratio may be off by three tolerances where the spectrum
hardly feels it.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .gap import GapTable
from .observables.base import Observable
from .verdict import FamilyGap

#: Families by stage, each with the beginnings of the names of its observables without their
#: channel; "" is any.
_OF_STAGE: Mapping[str, tuple[tuple[str, tuple[str, ...]], ...]] = {
    "gun": (("velocity", ("ln_velocity",)),),
    "contact": (
        ("peak, impulse, width", ("ln_peak", "ln_impulse", "ln_width_half")),
        ("shape", ("",)),
    ),
    "plate": (
        ("frequencies", ("ln frequency",)),
        ("damping", ("ln damping",)),
        ("amplitudes of modes", ("ln amplitude",)),
        ("rest and delay", ("rest", "delay")),
    ),
}
#: Families whose tolerances are finer than the laws of effects are: what is read from the free
#: ringing of a plate and beside its shock, and of the pressures of a gun.
FINER_THAN_LAWS = frozenset(
    {
        "frequencies",
        "damping",
        "amplitudes of modes",
        "rest and delay",
        "pressure trace",
        "set pressure",
    }
)
#: Families that a channel makes, whatever its observables are called.
_OF_CHANNEL: Mapping[str, str] = {"tank_pressure": "pressure trace", "set_pressure": "set pressure"}
#: Standard deviation of a background beyond the tolerance, in tolerances. Rough ones of development
#: campaigns have an rms of up to 1.9, causes outside of the catalogue one of two and more; from 0.5
#: to 0.8 it makes no difference there.
BEYOND = 0.7


def family_of(observable: Observable) -> str:
    """The family that an observable belongs to; that of its channel where it has no other."""
    if observable.channel in _OF_CHANNEL:
        return _OF_CHANNEL[observable.channel]
    if observable.unit == "dB":
        return "spectrum"
    name = observable.name.removeprefix(f"{observable.channel} ")
    for family, beginnings in _OF_STAGE.get(observable.stage, ()):
        if name.startswith(beginnings):
            return family
    return observable.channel.replace("_", " ")


def family_columns(gap: GapTable) -> dict[str, NDArray[np.intp]]:
    """By family, in the order of the observables: its columns of the gap table; those without any
    value left out."""
    names = np.array([family_of(item) for item in gap.observables])
    measured = np.isfinite(gap.mean).any(axis=0)
    columns = {
        name: np.flatnonzero((names == name) & measured) for name in dict.fromkeys(names.tolist())
    }
    return {name: own for name, own in columns.items() if own.size}


def family_gaps(gap: GapTable) -> tuple[FamilyGap, ...]:
    """Every family with its rms over configurations and observables, in the unit of its
    observables."""
    return tuple(
        FamilyGap.of(
            name,
            before=_rms(gap.mean[:, columns]),
            noise_floor=_rms(np.sqrt(gap.floor_variance[:, columns])),
            tolerance=_rms(gap.tolerance[columns]),
        )
        for name, columns in family_columns(gap).items()
    )


def background_probability(gap: GapTable) -> float:
    """The probability that the error of every family is a simulator's background: one within
    tolerance, and a larger one with a normal prior of what is beyond it. What nominal parameters
    that are declared uncertain may do is taken off, as the noise is."""
    expected = gap.floor_variance + (gap.nuisances**2).sum(axis=0)
    squares = [
        float(np.nanmean(gap.mean[:, columns] ** 2 - expected[:, columns]))
        / _rms(gap.tolerance[columns]) ** 2
        for columns in family_columns(gap).values()
    ]
    largest = float(np.sqrt(max([0.0, *squares])))
    return float(np.exp(-0.5 * (max(largest - 1.0, 0.0) / BEYOND) ** 2))


def _rms(values: Floats) -> float:
    return float(np.sqrt(np.nanmean(np.square(values))))
