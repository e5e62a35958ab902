"""What the ideal bench makes of a plan: speeds, pulses and spectra, worked out once for each."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ...array_types import Floats
from .contact_case import CasePulse, strikes
from .designs import design
from .gun_case import ln_velocity
from .plates import plate_of
from .ringing import accelerations, levels_db, pulses_of

#: At which spectra are worked out: rate, length, and when contact begins.
RATE_HZ, SAMPLES, START_S = 102_400.0, 6144, 2e-3


def speeds_of(kind: str, number: int) -> Floats:
    """Speeds (C,) in m/s at which a plan's impacts happen."""
    if kind == "chain":
        return np.asarray(np.exp(ln_velocity(kind, number, {})))
    return np.array([setting.speed_m_s for setting in design(kind, number)])


@lru_cache(maxsize=64)
def nominal_pulses(kind: str, number: int) -> tuple[CasePulse, ...]:
    """The pulses of a plan."""
    plan = design(kind, number)
    return tuple(pulses_of(plan) if kind == "plate" else strikes(plan, speeds_of(kind, number), {}))


def loudest_n(kind: str, number: int) -> float:
    """The largest peak of a plan."""
    return max(float(pulse.force_n.max()) for pulse in nominal_pulses(kind, number))


@lru_cache(maxsize=64)
def nominal_levels(kind: str, number: int) -> Floats:
    """Spectra (C, d) of a plan."""
    return levels_under(kind, number, nominal_pulses(kind, number))


def levels_under(kind: str, number: int, pulses: tuple[CasePulse, ...]) -> Floats:
    """Spectra (C, d) of the plate as its table has it, under pulses."""
    plate = plate_of(kind, number)
    shown = (accelerations(plate.table, pulse, START_S, RATE_HZ, SAMPLES) for pulse in pulses)
    return np.array([levels_db(rows, plate, RATE_HZ) for rows in shown])
