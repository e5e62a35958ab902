"""The configurations of a campaign: their factors in the words of the store, and labels for people.

Sentences for the report: what was taken for granted when a campaign was read.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign
from ...schema.configurations import configuration_factors
from ...schema.known_factors import BY_NAME
from ..record import CampaignRecord, Factor, RunConfiguration
from .impacts import StoredImpact
from .series import HitSeries

#: Columns of a projectile's own travel to the vent holes, and their units in m.
TRAVEL = {"travel_m": 1.0, "travel_mm": 1e-3}
#: A column is a note when so many of its runs differ in it; below so many runs nobody can tell.
_DIFFERENT, _RUNS = 0.8, 6
#: Beginnings of the names of what is read and not set; other numbers may be a design without repetitions.
_CONDITIONS = ("time", "date", "hour", "temperature", "humidity", "ambient", "order", "sequence", "index")


def read_settings(
    session: Session, keys: Sequence[int]
) -> tuple[tuple[RunConfiguration, ...], tuple[int, ...], tuple[str, ...]]:
    """Of runs by the store's `keys` of their configurations: configurations in the order of their first runs, the row
    of each run's, and sentences on columns that are no settings. Configurations that differ in those alone are one."""
    stored = configuration_factors(session, list(dict.fromkeys(keys)))
    notes = note_columns([stored[key] for key in keys])
    runs = [tuple(sorted((name, x) for name, x in stored[key].items() if name not in notes)) for key in keys]
    row_of = {setting: row for row, setting in enumerate(dict.fromkeys(runs))}
    sentences = tuple(f"{name}: a note on each run, and not a setting" for name in notes)
    return _labelled([dict(setting) for setting in row_of]), tuple(row_of[run] for run in runs), sentences


def note_columns(runs: Sequence[Mapping[str, Factor]]) -> tuple[str, ...]:
    """Columns of a table of runs that are no settings: remarks, and what was read off a thermometer or a clock.

    Of the factors of each run the free ones that are a text or a condition of its own in nearly every run.
    """
    notes = []
    for name in dict.fromkeys(name for run in runs for name in run if name not in BY_NAME):
        values = [run[name] for run in runs if name in run]
        differ = len(values) >= _RUNS and len(set(values)) >= _DIFFERENT * len(values)
        if differ and (name.lower().startswith(_CONDITIONS) or any(isinstance(value, str) for value in values)):
            notes.append(name)
    return tuple(notes)


def _labelled(settings: Sequence[Mapping[str, Factor]]) -> tuple[RunConfiguration, ...]:
    """Configurations in this order. A label names what varies; two that read the same are numbered."""
    names = dict.fromkeys(name for factors in settings for name in factors)
    varying = [name for name in names if len({factors.get(name) for factors in settings}) > 1]
    texts = [
        ", ".join(_factor_text(name, factors[name]) for name in varying if name in factors) or "the one setting"
        for factors in settings
    ]
    count = Counter(texts)
    return tuple(
        RunConfiguration(f"{text} ({i})" if count[text] > 1 else text, factors)
        for i, (text, factors) in enumerate(zip(texts, settings, strict=True), 1)
    )


def _factor_text(name: str, value: Factor) -> str:
    """`tip_radius_mm 30`: a number in the unit of its column."""
    column = BY_NAME.get(name)
    if isinstance(value, str):
        return f"{name} {value}"
    return f"{column.column} {value / column.scale:.6g}" if column else f"{name} {value:.6g}"


def travel_m(configuration: RunConfiguration) -> float | None:
    """The projectile's travel to the vent holes, m; None where no column has it.

    Raises `ValueError` for a column that is not a positive number.
    """
    name = next((name for name in TRAVEL if configuration.factors.get(name) is not None), None)
    if name is None:
        return None
    value = configuration.factors[name]
    if isinstance(value, str) or not value > 0:
        raise ValueError(f"{name} is {value!r} at {configuration.label}: expected a number above 0")
    return value * TRAVEL[name]


def assumptions(
    campaign: Campaign, record: CampaignRecord, hits: Sequence[StoredImpact], series: HitSeries
) -> Iterator[str]:
    """In the order of the chain: pressure, velocity, force, acceleration, plate."""
    yield from _gun(record, hits)
    yield from _velocity(hits)
    yield from _force(hits, series)
    for channel in sorted(series.of_impactor):
        yield f"{channel} rides on the impactor: it says nothing of the plate"
    if campaign.plate is None or campaign.plate.thickness_m is None:
        yield f"plate: {record.plate_thickness_m * 1e3:g} mm thick, since campaign.toml gives no thickness"
    if record.plate is not None and len(record.plate.impact_points) == 1:
        point = record.plate.impact_points[0]
        others = {str(c.factors.get("impact_position", point)) for c in record.configurations} - {point}
        if others:
            yield f"plate: hits at {', '.join(sorted(others))} too, and the modal table knows {point} alone"


def _gun(record: CampaignRecord, hits: Sequence[StoredImpact]) -> Iterator[str]:
    pressures = [(h.set_pressure_pa, h.recorded_pressure_pa) for h in hits if h.set_pressure_pa is not None]
    ratios = [recorded / (nominal or 1.0) for nominal, recorded in pressures if recorded is not None]
    if ratios:
        yield (
            f"tank pressure: as recorded in {len(ratios)} of {len(pressures)} shots, in the median "
            f"{float(np.median(ratios)) - 1:+.1%} from the set one; gauge"
        )
    elif pressures:
        yield "tank pressure: the set one, since none was recorded; gauge"
    travels = [run.travel_m for run in record.runs if run.travel_m is not None]
    if travels and record.gun is not None:
        column = next(name for name in TRAVEL if any(name in c.factors for c in record.configurations))
        yield (
            f"travel to the vent holes: {min(travels) * 1e3:g} to {max(travels) * 1e3:g} mm, as the column {column} "
            f"has it for {len(travels)} of {len(record.runs)} runs; [bench.gun] has {record.gun.travel_m * 1e3:g} mm"
        )


def _velocity(hits: Sequence[StoredImpact]) -> Iterator[str]:
    integrated = [hit for hit in hits if hit.velocity_source == "integrated"]
    if integrated:
        shares = [(hit.velocity_u_m_s or 0.0) / hit.velocity_m_s for hit in integrated if hit.velocity_m_s]
        yield (
            f"impact velocity of {len(integrated)} of {len(hits)} hits: integrated from the impactor's acceleration "
            f"(standard uncertainty {float(np.median(shares)) if shares else 0.0:.1%} in the median), which reads the "
            "velocity lost in compression: too low by what a yielding plate moves meanwhile"
        )
    corrected = sum(hit.velocity_source == "integrated with target motion" for hit in hits)
    if corrected:
        yield (
            f"impact velocity of {corrected} of {len(hits)} hits: integrated from the impactor's acceleration, with "
            "the motion added that the plate's surface had under the measured force"
        )
    stand_in = sum(hit.velocity_source == "impact" for hit in hits)
    if stand_in:
        yield f"muzzle velocity of {stand_in} of {len(hits)} shots: that at the plate, since none was measured before"
    missing = sum(hit.velocity_m_s is None for hit in hits)
    if 0 < missing < len(hits):
        yield f"{missing} of {len(hits)} runs have no measured velocity"


def _force(hits: Sequence[StoredImpact], series: HitSeries) -> Iterator[str]:
    pulses = sum(hit.has_pulse for hit in hits)
    silent = sum(hit.recording_id is not None and not hit.has_pulse for hit in hits)
    if series.without_force:
        yield (
            f"no force was recorded with {series.without_force} of {len(hits)} hits: their accelerations are used from "
            "where they begin to ring"
        )
    elif silent:
        yield f"no contact force in the recordings of {silent} of {len(hits)} hits: what else they hold is not used"
    if series.with_pulse < pulses:
        yield f"series of {series.with_pulse} of {pulses} hits are used, evenly chosen in each configuration"
    if series.force_cells > 1:
        yield f"contact force: the sum of {series.force_cells} force channels"
    if series.turned:
        yield f"force shows compression as negative in {series.turned} of {series.with_pulse} hits, and was turned"
    if series.double_hits:
        yield f"{series.double_hits} of {series.with_pulse} hits are followed by a second touch"
    for channel, count in sorted(series.rejected.items()):
        yield f"{channel}: left out in {count} of {series.with_pulse} hits, since quality checks reject it there"
