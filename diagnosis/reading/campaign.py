"""An ingested campaign as a record: configurations, runs in their order, bench, and what was taken
for granted.

A folder is read by an ingest into a store that is gone afterwards.
"""

from __future__ import annotations

import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ...dataset.rows import gun_bench, modal_plate, stored_materials
from ...schema.benches import Material as StoredMaterial
from ...schema.benches import ModalTable
from ...schema.campaigns import Campaign
from ...schema.configurations import configuration_factors
from ...schema.known_factors import BY_NAME
from ...schema.known_facts import facts_from_json
from ...schema.listings import get_campaign_id
from ...schema.recordings import SET_ASIDE, Recording
from ...schema.session import Writer, open_scratch_store, open_store
from ..record import CampaignRecord, Factor, Run, RunConfiguration
from .series import HitSeries, StoredImpact, read_exclusions, read_hits, read_series
from .tank_pressure import TankPressures, pressures_as_read, pressures_set, read_tank_pressures

#: Columns of a projectile's own travel to the vent holes, and their units in m.
TRAVEL = {"travel_m": 1.0, "travel_mm": 1e-3}
#: A column is a note when so many of its runs differ in it; below so many runs nobody can tell.
_DIFFERENT, _RUNS = 0.8, 6
#: Beginnings of the names of what is read and not set; other numbers may be a design without
#: repetitions.
_CONDITIONS = (
    "time",
    "date",
    "hour",
    "temperature",
    "humidity",
    "ambient",
    "order",
    "sequence",
    "index",
)


def read_settings(
    session: Session, keys: Sequence[int]
) -> tuple[tuple[RunConfiguration, ...], tuple[int, ...], tuple[str, ...]]:
    """Configurations in the order of their first runs, the row of each run's, and sentences on
    columns that are no settings. Configurations that differ in those alone are one.

    Parameters:
        session: An open session of the store.
        keys: The store's key of the configuration of each run, in the order of the runs.
    """
    stored = configuration_factors(session, list(dict.fromkeys(keys)))
    notes = note_columns([stored[key] for key in keys])
    runs = [
        tuple(sorted((name, x) for name, x in stored[key].items() if name not in notes))
        for key in keys
    ]
    row_of = {setting: row for row, setting in enumerate(dict.fromkeys(runs))}
    sentences = tuple(f"{name}: a note on each run, and not a setting" for name in notes)
    return (
        _labelled([dict(setting) for setting in row_of]),
        tuple(row_of[run] for run in runs),
        sentences,
    )


def note_columns(runs: Sequence[Mapping[str, Factor]]) -> tuple[str, ...]:
    """Columns of a table of runs that are no settings: remarks, and what was read off a thermometer
    or a clock.

    Of the factors of each run the free ones that are a text or a condition of its own in nearly
    every run.

    Parameters:
        runs: The factors of each run, by name.
    """
    notes = []
    for name in dict.fromkeys(name for run in runs for name in run if name not in BY_NAME):
        values = [run[name] for run in runs if name in run]
        differ = len(values) >= _RUNS and len(set(values)) >= _DIFFERENT * len(values)
        if differ and (
            name.lower().startswith(_CONDITIONS) or any(isinstance(value, str) for value in values)
        ):
            notes.append(name)
    return tuple(notes)


def _labelled(settings: Sequence[Mapping[str, Factor]]) -> tuple[RunConfiguration, ...]:
    """Configurations in this order. A label names what varies; two that read the same are
    numbered."""
    names = dict.fromkeys(name for factors in settings for name in factors)
    varying = [name for name in names if len({factors.get(name) for factors in settings}) > 1]
    texts = [
        ", ".join(_factor_text(name, factors[name]) for name in varying if name in factors)
        or "the one setting"
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

    Parameters:
        configuration: The configuration, in whose factors the column is looked for.

    Raises:
        ValueError: For a column that is not a positive number.
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
    """Sentences on what was taken for granted, in the order of the chain: pressure, velocity,
    force, acceleration, plate.

    Parameters:
        campaign: The campaign's row in the store.
        record: What was read of the campaign.
        hits: Its impacts or shots, in the order of runs.
        series: The series that were read of them, and what was left out.
    """
    yield from _gun(record, hits)
    yield from _velocity(hits)
    yield from _force(hits, series)
    for channel in sorted(series.of_impactor):
        yield f"{channel} rides on the impactor: it says nothing of the plate"
    if campaign.plate is None or campaign.plate.thickness_m is None:
        yield (
            f"plate: {record.plate_thickness_m * 1e3:g} mm thick, since "
            f"campaign.toml gives no thickness"
        )
    if record.plate is not None and len(record.plate.impact_points) == 1:
        point = record.plate.impact_points[0]
        others = {str(c.factors.get("impact_position", point)) for c in record.configurations} - {
            point
        }
        if others:
            yield (
                f"plate: hits at {', '.join(sorted(others))} too, and the modal "
                f"table knows {point} alone"
            )


def _gun(record: CampaignRecord, hits: Sequence[StoredImpact]) -> Iterator[str]:
    pressures = [
        (h.set_pressure_pa, h.recorded_pressure_pa) for h in hits if h.set_pressure_pa is not None
    ]
    ratios = [
        recorded / (nominal or 1.0) for nominal, recorded in pressures if recorded is not None
    ]
    if ratios:
        yield (
            f"tank pressure: as recorded in {len(ratios)} of {len(pressures)} shots, in the median "
            f"{float(np.median(ratios)) - 1:+.1%} from the set one; gauge"
        )
        if len(ratios) < len(pressures):
            yield (
                f"tank pressure of {len(pressures) - len(ratios)} shots: the set one, on the line "
                "through what was set and recorded in the others"
            )
    elif pressures:
        yield "tank pressure: the set one, since none was recorded; gauge"
    travels = [run.travel_m for run in record.runs if run.travel_m is not None]
    if travels and record.gun is not None:
        column = next(
            name for name in TRAVEL if any(name in c.factors for c in record.configurations)
        )
        yield (
            f"travel to the vent holes: {min(travels) * 1e3:g} to {max(travels) * 1e3:g} mm, as "
            f"the column {column} has it for {len(travels)} of {len(record.runs)} runs; "
            f"[bench.gun] has {record.gun.travel_m * 1e3:g} mm"
        )


def _tank_pressure(record: CampaignRecord, pressures: TankPressures) -> Iterator[str]:
    """How the pressure before a shot is read where no rest shows it, and what keeps records from
    being compared."""
    if record.gun is None:
        return
    if pressures.levels:
        shares = [u_pa / level_pa for level_pa, u_pa in pressures.levels.values()]
        yield (
            f"tank pressure of {len(pressures.levels)} shots whose record shows no certain rest: "
            "the level of the record, given that the valve opens as long after the trigger as in "
            f"the other shots (standard uncertainty {float(np.median(shares)):.1%} in the median), "
            "is weighed with the line through the others"
        )
    if pressures.without_passage:
        yield (
            f"tank pressure: its record is not compared in {pressures.without_passage} shots, "
            "since no laser shows when the projectile passed"
        )
    if pressures.rejected:
        yield (
            f"tank pressure: its record is left out in {pressures.rejected} "
            f"shots, since quality checks reject it"
        )


def _velocity(hits: Sequence[StoredImpact]) -> Iterator[str]:
    integrated = [hit for hit in hits if hit.velocity_source == "integrated"]
    if integrated:
        shares = [
            (hit.velocity_u_m_s or 0.0) / hit.velocity_m_s for hit in integrated if hit.velocity_m_s
        ]
        yield (
            f"impact velocity of {len(integrated)} of {len(hits)} hits: integrated from the "
            "impactor's acceleration (standard uncertainty "
            f"{float(np.median(shares)) if shares else 0.0:.1%} in the median), which reads the "
            "velocity lost in compression: too low by what a yielding plate moves meanwhile"
        )
    corrected = sum(hit.velocity_source == "integrated with target motion" for hit in hits)
    if corrected:
        yield (
            f"impact velocity of {corrected} of {len(hits)} hits: integrated "
            f"from the impactor's acceleration, with "
            "the motion added that the plate's surface had under the measured force"
        )
    stand_in = sum(hit.velocity_source == "impact" for hit in hits)
    if stand_in:
        yield (
            f"muzzle velocity of {stand_in} of {len(hits)} shots: that at the "
            f"plate, since none was measured before"
        )
    missing = sum(hit.velocity_m_s is None for hit in hits)
    if 0 < missing < len(hits):
        yield f"{missing} of {len(hits)} runs have no measured velocity"


def _force(hits: Sequence[StoredImpact], series: HitSeries) -> Iterator[str]:
    pulses = sum(hit.has_pulse for hit in hits)
    silent = sum(hit.recording_id is not None and not hit.has_pulse for hit in hits)
    if series.without_force:
        yield (
            f"no force was recorded with {series.without_force} of {len(hits)} hits: their "
            "accelerations are used from where they begin to ring"
        )
    elif silent:
        yield (
            f"no contact force in the recordings of {silent} of {len(hits)} hits: "
            f"what else they hold is not used"
        )
    if series.with_pulse < pulses:
        yield (
            f"series of {series.with_pulse} of {pulses} hits are used, evenly "
            f"chosen in each configuration"
        )
    if series.force_cells > 1:
        yield f"contact force: the sum of {series.force_cells} force channels"
    if series.turned:
        yield (
            f"force shows compression as negative in {series.turned} of "
            f"{series.with_pulse} hits, and was turned"
        )
    if series.double_hits:
        yield f"{series.double_hits} of {series.with_pulse} hits are followed by a second touch"
    for channel, count in sorted(series.rejected.items()):
        check_names = ", ".join(sorted(series.checks[channel]))
        yield (
            f"{channel}: left out in {count} of {series.with_pulse} hits, since quality checks "
            f"reject it there ({check_names})"
        )


#: Where neither the campaign nor its caller says how thick the plate is: the thesis's.
_THICKNESS_M = 0.010


def read_campaign(
    session: Session, name: str, *, most_runs_per_configuration: int = 10
) -> CampaignRecord:
    """A campaign of the store.

    Parameters:
        session: An open session of the store.
        name: The name of the campaign.
        most_runs_per_configuration: The largest number of runs of each configuration whose series
            are read, evenly chosen; by default 10. Velocities are those of all runs.

    Raises:
        LookupError: For an unknown campaign.
        ValueError: For a campaign without any run, for a channel that holds no number, and for a
            projectile's travel that is no length.
    """
    campaign = session.get_one(Campaign, get_campaign_id(session, name))
    hits = read_hits(session, campaign)
    if not hits:
        raise ValueError(
            f"campaign {name!r} holds no run; ingest its folder first: pyroshock ingest FOLDER"
        )
    exclusions = read_exclusions(session, campaign.id)
    configurations, rows, notes = read_settings(session, [hit.configuration_id for hit in hits])
    travels = [travel_m(configuration) for configuration in configurations]
    with_series = _hits_with_series(hits, rows, most_runs_per_configuration)
    series = read_series(session, hits, with_series, exclusions)
    recorded = [
        row if campaign.kind == "gun" and hit.recording_id is not None else None
        for hit, row in zip(hits, rows, strict=True)
    ]
    shots = evenly_chosen(recorded, most_runs_per_configuration)
    pressures = read_tank_pressures(session, hits, shots, exclusions)
    materials, bench = stored_materials(session), campaign.plate
    modes = (
        session.get_one(ModalTable, bench.modal_table_id)
        if bench and bench.modal_table_id is not None
        else None
    )
    material = (
        session.get_one(StoredMaterial, bench.material_id)
        if bench and bench.material_id is not None
        else None
    )
    record = CampaignRecord(
        name=campaign.name,
        kind=campaign.kind,
        configurations=configurations,
        runs=tuple(
            Run(
                configuration=row,
                run=hit.run,
                repetition=hit.repetition,
                order=order,
                tank_pressure_pa=pressure_pa,
                bullet_mass_kg=hit.bullet_mass_kg,
                velocity_m_s=hit.velocity_m_s,
                velocity_u_m_s=hit.velocity_u_m_s,
                travel_m=travels[row],
                force=series.force.get(order),
                accelerations=series.accelerations.get(order, {}),
                tank_pressure=pressures.traces.get(order),
                set_pressure_pa=set_pa,
            )
            for order, (hit, row, pressure_pa, set_pa) in enumerate(
                zip(
                    hits,
                    rows,
                    pressures_as_read(hits, pressures.levels),
                    pressures_set(hits),
                    strict=True,
                )
            )
        ),
        gun=gun_bench(campaign.gun) if campaign.gun else None,
        hammer_mass_kg=campaign.hammer.mass_kg if campaign.hammer else None,
        plate=modal_plate(modes) if modes else None,
        plate_thickness_m=(bench.thickness_m if bench else None) or _THICKNESS_M,
        plate_material=material.name if material else None,
        plate_outline_m=tuple(
            (float(x), float(y)) for x, y in (bench.outline_m if bench else None) or ()
        ),
        # By the store's names, as factors have them, and by every spelling in lower case.
        materials={**materials, **{item.name: item for item in materials.values()}},
        known_facts=facts_from_json(campaign.known_facts),
    )
    set_aside = (Recording.campaign_id == campaign.id, Recording.status == SET_ASIDE)
    if unread := session.scalar(select(func.count()).select_from(Recording).where(*set_aside)):
        notes = (*notes, f"recordings that could not be read and are left out: {unread}")
    return replace(
        record,
        assumptions=(
            *notes,
            *_tank_pressure(record, pressures),
            *assumptions(campaign, record, hits, series),
        ),
    )


def _hits_with_series(hits: Sequence[StoredImpact], rows: Sequence[int], most: int) -> list[int]:
    """Places of some hits with a pulse of each configuration, then of some first hits of recordings
    without any."""
    with_pulse = [row if hit.has_pulse else None for hit, row in zip(hits, rows, strict=True)]
    recordings = {None, *(hit.recording_id for hit in hits if hit.has_pulse)}
    silent: list[int | None] = []
    for hit, row in zip(hits, rows, strict=True):
        silent.append(None if hit.recording_id in recordings else row)
        recordings.add(hit.recording_id)
    return [*evenly_chosen(with_pulse, most), *evenly_chosen(silent, most)]


def evenly_chosen(groups: Sequence[int | None], most: int) -> list[int]:
    """Places of some members of each group, evenly over its order.

    Parameters:
        groups: The group of each member; None is of no group.
        most: The largest number of members of a group that are chosen.
    """
    members_of: dict[int, list[int]] = {}
    for i, group in enumerate(groups):
        if group is not None:
            members_of.setdefault(group, []).append(i)
    chosen: list[int] = []
    for members in members_of.values():
        places = np.unique(
            np.linspace(0, len(members) - 1, min(most, len(members))).round().astype(int)
        )
        chosen += [members[place] for place in places]
    return sorted(chosen)


#: Folders above this are ingested into a file of a temporary folder, not into memory.
IN_MEMORY_BYTES = 256 * 2**20


def read_folder(path: Path) -> CampaignRecord:
    """The campaign in a folder, as `read_campaign` gives it. Leaves nothing behind.

    Parameters:
        path: The folder of the campaign.

    Raises:
        IngestError: For a folder that the ingest refuses.
        ValueError: For a campaign that `read_campaign` refuses.
    """
    from ...ingest.load import ingest_folder

    path = Path(path)
    large = sum(file.stat().st_size for file in path.rglob("*") if file.is_file()) > IN_MEMORY_BYTES
    with tempfile.TemporaryDirectory(prefix="pyroshock-") as scratch:
        writer = Writer("diagnose", "temporary")
        scratch_file = f"sqlite:///{scratch}/campaign.db"
        with (
            open_store(scratch_file, writer, create=True)
            if large
            else open_scratch_store(writer) as store
        ):
            report = ingest_folder(store, path, jobs=None if large else 1)
            with store.reading() as session:
                return read_campaign(session, report.campaign)
