"""By how much a cause moves what a campaign shows.

What a cause changes in each stage, beyond what the nominal bench makes of the measured entrance.

What the ideal bench makes of a plan: speeds, pulses and spectra, worked out once for each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np

from ...array_types import Floats
from .case import GUN_KINDS, STAGES, TOLERANCES, ActingCause
from .contact_case import CasePulse, cell_reading, strikes
from .designs import design
from .gun_case import ln_truth, ln_velocity
from .plates import changed, plate_of
from .ringing import accelerations, levels_db, pulses_of, sensor_readings
from .unknown_effects import READINGS

#: At which spectra are worked out: rate, length, and when contact begins.
RATE_HZ, SAMPLES, START_S = 102_400.0, 6144, 2e-3


def speeds_of(kind: str, number: int) -> Floats:
    """Speeds (C,) in m/s at which a plan's impacts happen."""
    if kind in GUN_KINDS:
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


def in_gun(kind: str, number: int, cause: ActingCause) -> Floats:
    """(C, 1): ln of the recorded velocity."""
    plan = design(kind, number)
    nominal = ln_velocity(kind, number, {})
    added = cause.outside(plan).ln_velocity(plan, nominal, cause.places(len(plan)))
    return np.asarray(
        (ln_velocity(kind, number, cause.table, cause.laws) - nominal + added)[:, None]
    )


def in_contact(kind: str, number: int, cause: ActingCause) -> Floats:
    """(C, 3): ln of peak, impulse and width, at the nominal speeds as recorded ones."""
    plan = design(kind, number)
    if not cause.touches("contact.", "sensor.force", "sensor.velocity"):
        return np.zeros((len(plan), 3))
    nominal = np.array([pulse.figures for pulse in nominal_pulses(kind, number)])
    speeds = np.exp(ln_truth(plan, np.log(speeds_of(kind, number)), cause.table, cause.laws))
    shown = _load_cell_pulses(kind, number, cause, strikes(plan, speeds, cause.table, cause.laws))
    return np.asarray(np.array([pulse.figures for pulse in shown]) - nominal)


def in_plate(kind: str, number: int, cause: ActingCause) -> Floats:
    """(C, d): dB at third octaves of each channel, at the nominal pulses."""
    misread = cause.family in READINGS or cause.touches("sensor.force")
    nominal = nominal_levels(kind, number)
    if not misread and not cause.touches(
        "plate.", "sensor.acceleration", "sensor.mount", "sensor.zero"
    ):
        return np.zeros_like(nominal)
    shown = _ringing(kind, number, cause)
    if not misread:
        return np.asarray(shown - nominal)
    recorded = _load_cell_pulses(kind, number, cause, nominal_pulses(kind, number))
    return np.asarray(shown - levels_under(kind, number, tuple(recorded)))


def _load_cell_pulses(
    kind: str, number: int, cause: ActingCause, pulses: Sequence[CasePulse]
) -> list[CasePulse]:
    """What the load cell shows of true pulses."""
    plan, loudest = design(kind, number), loudest_n(kind, number)
    outside, places = cause.outside(plan), cause.places(len(plan))
    acted = (
        outside.pulse(s, p, at, loudest) for s, p, at in zip(plan, pulses, places, strict=True)
    )
    return [cell_reading(pulse, cause.table, cause.laws) for pulse in acted]


def _ringing(kind: str, number: int, cause: ActingCause) -> Floats:
    """Spectra (C, d) that the accelerometers show under the nominal pulses."""
    plan, plate, loudest = design(kind, number), plate_of(kind, number), loudest_n(kind, number)
    outside, modes, rows = cause.outside(plan), changed(plate, cause.table, cause.laws), []
    pulses = nominal_pulses(kind, number)
    for setting, pulse, order in zip(plan, pulses, cause.places(len(plan)), strict=True):
        peak = float(pulse.force_n.max())
        true = accelerations(
            outside.modes(modes, peak, loudest, order), pulse, START_S, RATE_HZ, SAMPLES
        )
        shown = outside.acceleration(setting, true, RATE_HZ, order, peak / loudest)
        rows.append(
            levels_db(sensor_readings(shown, RATE_HZ, cause.table, cause.laws), plate, RATE_HZ)
        )
    return np.array(rows)


_CHANGES = {"gun": in_gun, "contact": in_contact, "plate": in_plate}


def changes(kind: str, number: int, cause: ActingCause) -> dict[str, Floats]:
    """By stage (C, d): ln v; ln peak, impulse, width; dB at third octaves of each channel."""
    return {stage: changed_stage(stage, kind, number, cause) for stage in STAGES[kind]}


def changed_stage(stage: str, kind: str, number: int, cause: ActingCause) -> Floats:
    """(C, d) of one stage, in the unit of `TOLERANCES`."""
    return _CHANGES[stage](kind, number, cause)


def gaps(moved: Mapping[str, Floats]) -> dict[str, float]:
    """Root mean square of each stage's changes, in tolerances; infinite where there is no
    answer."""
    with np.errstate(invalid="ignore", over="ignore"):
        sizes = {
            stage: float(np.sqrt(np.mean(rows**2))) / TOLERANCES[stage]
            for stage, rows in moved.items()
        }
    return {stage: size if np.isfinite(size) else np.inf for stage, size in sizes.items()}


@lru_cache(maxsize=8192)
def gap(kind: str, number: int, cause: ActingCause) -> float:
    """The largest of the stages' gaps, in tolerances."""
    return max(gaps(changes(kind, number, cause)).values())
