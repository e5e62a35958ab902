"""Force and accelerometers with the wrong sign, in each other's place, or in another unit than the
modal table's.

Accelerometers are compared with the plate over the first millisecond of their records: so early,
neither damping nor a few per cent of stiffness have moved the record far, and a correlation knows
no unit.

Settings of bench and runs that no bench of this kind has: a number in another unit than its
column's.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from ...array_types import Floats
from ...ingest.folder.unit_mistakes import unit_mistakes
from ...schema.known_factors import NONE
from ...twin.plate.modal import ModalPlate
from ...twin.plate.response import kept_below, respond
from ..record import CampaignRecord, Run, Series
from .units import LikelyMistake, LogGap, Suspicion, unit_finding

#: From the start of contact on; longer where the force takes longer, to so many times its rise.
_EARLY_S, _RISES = 1e-3, 2.0
#: Share of the sampling rate up to which the plate's modes are asked.
_BELOW = 0.45
#: Below this a sign is wrong (a force that its filter delays reaches -0.5 against a right one). Two
#: channels are swapped where each fits the other better by `_BETTER`, and `_WELL`.
_REVERSED, _BETTER, _WELL = -0.8, 0.3, 0.6
#: Gains (nats) of channels that differ by less may have the force in common.
_ALIKE = 0.05
#: A load cell and its filter ring to a third of the peak at worst (measured: 3 %); an
#: accelerometer's record swings. A gun's cells are preloaded, and an anvil on them swings back
#: after the blow (measured on the virtual gun: 60 %).
_MOST_PULL, _MOST_PULL_BEHIND_ANVIL = 0.5, 0.8


def tensile_force(record: CampaignRecord) -> list[LikelyMistake]:
    """A refusal where the force falls as far below its rest as a contact cannot: the channel is
    another sensor's."""
    shares, limits = [], []
    for run in record.runs:
        if run.force is not None and run.force.values.size:
            rise, fall = run.force.excursions
            anvil = record.configurations[run.configuration].factors.get("anvil_material", NONE)
            shares.append(fall / rise if rise > 0 else 0.0)
            limits.append(
                _MOST_PULL_BEHIND_ANVIL if record.kind == "gun" and anvil != NONE else _MOST_PULL
            )
    if not shares or np.median(np.array(shares) / np.array(limits)) < 1.0:
        return []
    message = (
        f"force pulls {float(np.median(shares)):.0%} as much as it pushes, which no contact does: "
        "is it another sensor's channel? check the names in [channels.*] of campaign.toml"
    )
    return [LikelyMistake("refuse", "force", message)]


def channel_findings(record: CampaignRecord) -> list[LikelyMistake]:
    """What the first millisecond tells of accelerometers; nothing where the plate or the force is
    not known."""
    fits = early_fits(record)
    if fits is None:
        return []
    return list(_swapped(fits)) or [*_reversed(fits), *_gains(fits)]


@dataclass(frozen=True, eq=False)
class EarlyFits:
    """k channels that are the plate's sensors, in C configurations that have them and the force.

    `correlation` (k, k): medians over configurations, each channel's record (rows) with each
    sensor's simulation (columns). `log_gain` (C, k): logarithm of how much of its own simulation a
    record holds, whatever its sign.
    """

    names: tuple[str, ...]
    correlation: Floats
    log_gain: Floats


def early_fits(record: CampaignRecord) -> EarlyFits | None:
    """None where the plate is not known, or no run has both force and accelerations."""
    plate = record.plate
    if plate is None:
        return None
    names = tuple(
        name for name in plate.sensors if any(name in run.accelerations for run in record.runs)
    )
    fits = []
    for c, configuration in enumerate(record.configurations if names else ()):
        usable = [
            run
            for run in record.runs
            if run.configuration == c
            and run.force is not None
            and all(name in run.accelerations for name in names)
        ]
        if usable:
            point = str(configuration.factors.get("impact_position", ""))
            fits.append(_early_fit(plate, usable[len(usable) // 2], names, point))
    if not fits:
        return None
    correlation, log_gain = (np.array(values) for values in zip(*fits, strict=True))
    return EarlyFits(names, np.median(correlation, axis=0), log_gain)


def _early_fit(
    plate: ModalPlate, run: Run, names: tuple[str, ...], point: str
) -> tuple[Floats, Floats]:
    """(k, k) correlations and (k,) logarithms of gains."""
    assert run.force is not None
    rise = run.force.time_s[np.argmax(run.force.values)] if run.force.values.size else 0.0
    rate = run.accelerations[names[0]].sampling_rate_hz
    time = np.arange(round(max(_EARLY_S, _RISES * float(rise)) * rate)) / rate
    place = point if point in plate.impact_points else plate.impact_points[0]
    simulated = respond(
        kept_below(plate, _BELOW * rate), _at(run.force, time), 1 / rate, place, names
    )
    measured = np.array([_at(run.accelerations[name], time) for name in names])
    products = measured @ simulated.T
    sizes = np.linalg.norm(measured, axis=1), np.linalg.norm(simulated, axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = np.nan_to_num(products / np.outer(*sizes))
        log_gain = np.log(np.abs(np.diag(products)) / sizes[1] ** 2)
    return correlation, log_gain


def _at(series: Series, time_s: Floats) -> Floats:
    """At other instants, less its rest before contact; nothing beyond its ends."""
    return np.interp(time_s, series.time_s, series.values - series.rest, left=0.0, right=0.0)


def _reversed(fits: EarlyFits) -> Iterator[LikelyMistake]:
    for name, fit in zip(fits.names, np.diag(fits.correlation), strict=True):
        if fit <= _REVERSED:
            message = (
                f"{name} begins with the sign opposite to the plate's (correlation {fit:.2f}): is "
                f"its axis or polarity reversed? turn shape_{name} in the modal table, or its "
                "sensitivity in campaign.toml"
            )
            yield LikelyMistake("refuse", name, message)


def _swapped(fits: EarlyFits) -> Iterator[LikelyMistake]:
    size = np.abs(fits.correlation)
    for i, j in combinations(range(len(fits.names)), 2):
        crossed, straight = (size[i, j] + size[j, i]) / 2, (size[i, i] + size[j, j]) / 2
        if min(size[i, j], size[j, i]) >= _WELL and crossed >= straight + _BETTER:
            message = (
                f"{fits.names[i]} and {fits.names[j]} fit each other's place on the plate "
                f"(correlation {crossed:.2f}) better than their own ({straight:.2f}): are they "
                "swapped? check [channels.*] in campaign.toml and the columns of the modal table"
            )
            yield LikelyMistake("refuse", fits.names[i], message)


def _gains(fits: EarlyFits) -> Iterator[LikelyMistake]:
    """Of channels that fit but for their size; one finding for all where all are off alike."""
    centres = np.median(fits.log_gain, axis=0)
    correlated = [
        i
        for i in range(len(fits.names))
        if abs(fits.correlation[i, i]) >= _WELL and np.isfinite(centres[i])
    ]
    together = len(correlated) == len(fits.names) and np.ptp(centres) <= _ALIKE
    for rows in [correlated] if together else [[i] for i in correlated]:
        channel = "acceleration" if len(rows) > 1 else fits.names[rows[0]]
        shifts = [
            (channel, mistake, math.log(factor))
            for factor, mistake in unit_mistakes("acceleration")
        ]
        if together:
            shifts += [
                ("force", mistake, -math.log(factor)) for factor, mistake in unit_mistakes("force")
            ]
        gains = fits.log_gain[:, rows]
        suspicions = (
            Suspicion(name, mistake, shift, LogGap.of(gains - shift))
            for name, mistake, shift in shifts
        )
        if finding := unit_finding(channel, "plate", LogGap.of(gains), suspicions):
            yield finding


class _Limit(NamedTuple):
    """Beyond `low` or `high` (SI) a setting is another unit's; the words say which to look for."""

    low: float
    high: float
    below: str = "another unit"
    above: str = "another unit"


_GUN = {
    "tank_volume_m3": _Limit(1e-6, 2.0, above="litres"),
    "bore_diameter_m": _Limit(1e-3, 1.0, above="millimetres"),
    "projectile_diameter_m": _Limit(1e-3, 1.0, above="millimetres"),
    "travel_m": _Limit(0.01, 30.0, above="millimetres"),
}
_LIMITS = {
    **_GUN,
    "mass_kg": _Limit(1e-3, 50.0, below="tonnes", above="grams"),
    "thickness_m": _Limit(1e-4, 0.5, above="millimetres"),
    "damping_ratio": _Limit(0.0, 0.2, above="per cent"),
    "frequency_hz": _Limit(20.0, 1e6, below="kilohertz"),
    "tip_radius_mm": _Limit(2e-4, 20.0, below="metres", above="micrometres"),
    "bullet_mass_kg": _Limit(1e-4, 50.0, below="tonnes", above="grams"),
    "tank_pressure_pa": _Limit(100.0, 1e8, above="pascals, in a column of bar"),
    "travel_m of a run": _Limit(
        0.01, 30.0, below="metres, in a column of millimetres", above="millimetres"
    ),
    "velocity_m_s": _Limit(1e-4, 2000.0, below="km/s", above="mm/s or cm/s"),
    "sampling rate of the force": _Limit(1e3, 1e9, below="kilohertz"),
}


def setting_findings(record: CampaignRecord) -> list[LikelyMistake]:
    """A refusal for each setting that is out of bounds, with the first value that is."""
    findings: dict[str, LikelyMistake] = {}
    for setting, value in _settings(record):
        limit = _LIMITS[setting]
        if value is None or limit.low <= value <= limit.high:
            continue
        unit = limit.below if value < limit.low else limit.above
        message = (
            f"{setting} is {value:.4g}, and a bench has {limit.low:g} to {limit.high:g} in SI: is "
            f"it in {unit}? correct it where it stands in the campaign's folder"
        )
        findings.setdefault(setting, LikelyMistake("refuse", setting, message))
    return list(findings.values())


def _settings(record: CampaignRecord) -> Iterator[tuple[str, float | None]]:
    if record.gun is not None:
        yield from ((setting, float(getattr(record.gun, setting))) for setting in _GUN)
    yield "mass_kg", record.hammer_mass_kg
    yield "thickness_m", record.plate_thickness_m
    if record.plate is not None and record.plate.frequency_hz.size:
        yield (
            "damping_ratio",
            float(sorted(record.plate.damping_ratio)[record.plate.damping_ratio.size // 2]),
        )
        yield "frequency_hz", float(record.plate.frequency_hz.max())
    radii = (configuration.factors.get("tip_radius") for configuration in record.configurations)
    yield from (("tip_radius_mm", radius) for radius in radii if isinstance(radius, float))
    for run in record.runs:
        yield "bullet_mass_kg", run.bullet_mass_kg
        yield "tank_pressure_pa", run.tank_pressure_pa
        yield "travel_m of a run", run.travel_m
        yield "velocity_m_s", run.velocity_m_s or None
        yield (
            "sampling rate of the force",
            None if run.force is None else run.force.sampling_rate_hz,
        )
