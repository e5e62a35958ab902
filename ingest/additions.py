"""Facts that a stored campaign lacked and its folder has now: of the bench, and factors of rows.
They are added. What stored samples mean (their calibration) may not change from one ingest to the
next.

A fact that the store has stays as it is (`stored_rows`). Figures, pulses and verdicts of stored
impacts are not made anew; datasets that are frozen keep the facts that they were frozen with
(`schema.frozen_facts`).
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace

from sqlalchemy import bindparam, select, update
from sqlalchemy.orm import Session

from ..schema.campaigns import Campaign
from ..schema.configurations import configuration_ids
from ..schema.frozen_facts import freeze_facts
from ..schema.impacts import Impact, Shot
from ..schema.recordings import RecordedChannel, Recording
from ..schema.session import Store
from ..signals.calibration import Calibration
from ..signals.channel import Sensor
from .errors import IngestError, difference, printable
from .folder import FILE, CampaignFile
from .modes import ModalTableFile
from .rows import bench_additions, campaign_values
from .runs import RunRow
from .stored import calibration_of
from .stored_rows import KnownRow, RowDifferences

#: Run and repetition.
HitKey = tuple[int, int]


@dataclass(frozen=True)
class Additions:
    """Facts of the bench ("bench.hammer.mass_kg = 0.32"), and for each row with new factors the
    stored hits that it stands for and the names of the factors."""

    bench: tuple[str, ...] = ()
    rows: tuple[tuple[RunRow, tuple[HitKey, ...], tuple[str, ...]], ...] = ()

    def __bool__(self) -> bool:
        return bool(self.bench or self.rows)

    def words(self, kind: str) -> str:
        """For a person: "bench.hammer.mass_kg = 0.32; boundary_conditions of 11 impacts"."""
        counts: Counter[str] = Counter()
        for _, hits, names in self.rows:
            counts.update({name: len(hits) for name in names})
        what = "shots" if kind == "gun" else "impacts"
        return "; ".join(
            [*self.bench, *(f"{name} of {count} {what}" for name, count in sorted(counts.items()))]
        )


def row_additions(
    session: Session,
    rows: Sequence[RunRow],
    stored_rows: Mapping[HitKey, KnownRow],
    differences: RowDifferences,
) -> tuple[tuple[RunRow, tuple[HitKey, ...], tuple[str, ...]], ...]:
    """Rows with factors that the stored ones lack, and no other difference."""
    runs = Counter(row.run for row in rows)
    added = []
    for row in rows:
        stored = stored_rows.get((row.run, row.repetition))
        if stored is None:
            continue
        names = differences.added_factors(session, row, stored)
        if names:
            hits = [(row.run, row.repetition)]
            if runs[row.run] == 1:  # the only row of a run stands for all hits of its recording
                hits = [
                    key
                    for key, other in stored_rows.items()
                    if key[0] == row.run and _same_row(other, stored)
                ]
            added.append((row, tuple(sorted(hits)), names))
    return tuple(added)


def _same_row(first: KnownRow, second: KnownRow) -> bool:
    return (first.recording, first.factors) == (second.recording, second.factors)


def add_facts(
    store: Store,
    session: Session,
    file: CampaignFile,
    modes: ModalTableFile | None,
    additions: Additions,
) -> None:
    """Write what is added, with a row of provenance that says what; nothing where another process
    has added it."""
    campaign = session.scalars(select(Campaign).where(Campaign.name == file.name)).one()
    bench = bool(bench_additions(session, campaign, file))
    table: type[Impact] | type[Shot] = Shot if campaign.kind == "gun" else Impact
    configurations = configuration_ids(session, [row.levels for row, _, _ in additions.rows])
    there = select(table.run, table.repetition, table.configuration_id).where(
        table.campaign_id == campaign.id
    )
    stored = (
        {(run, repetition): key for run, repetition, key in session.execute(there)}
        if additions.rows
        else {}
    )
    wanted = {
        hit: configuration
        for (_, hits, _), configuration in zip(additions.rows, configurations, strict=True)
        for hit in hits
        if stored.get(hit) not in (None, configuration)
    }
    if not bench and not wanted:
        return
    freeze_facts(session, campaign, wanted, bench=bench)
    text = f"{store.writer.command} (added to campaign {file.name!r}: {additions.words(file.kind)})"
    written_by = replace(store.writer, command=text).insert(session.connection())
    campaign.written_by_id = written_by
    if bench:
        for name, value in campaign_values(session, file, modes).items():
            if name.endswith("_id") or name in ("fingerprint", "known_facts"):
                setattr(campaign, name, value)
    session.flush()
    hits = [
        {"hit_run": run, "hit_repetition": repetition, "to": key}
        for (run, repetition), key in wanted.items()
    ]
    for hit_table in (Impact, Shot) if hits else ():
        of_hit = (
            hit_table.run == bindparam("hit_run"),
            hit_table.repetition == bindparam("hit_repetition"),
        )
        rows = update(hit_table).where(hit_table.campaign_id == campaign.id, *of_hit)
        rows = rows.values(configuration_id=bindparam("to"), written_by_id=written_by)
        session.connection().execute(rows, hits)


@dataclass(frozen=True)
class Stored:
    """A channel's calibration as the store has it; `full_scale` in `unit`."""

    name: str
    quantity: str
    unit: str
    sensitivity: float | None
    offset_v: float | None
    position: str | None
    axis: str | None
    full_scale: float | None
    si_gain: float
    si_offset: float


def refuse_changed_channels(session: Session, campaign: Campaign, file: CampaignFile) -> None:
    """Raise `IngestError` where `[channels]` gives a stored channel another meaning, with both
    values of each change.

    Another meaning is another quantity, conversion to SI, full scale, position or axis; the same
    meaning may be written otherwise (10 kN for 10,000 N). Force channels are summed, so that one
    more or less is a change too.
    """
    columns = (getattr(RecordedChannel, item.name) for item in fields(Stored))
    query = select(*columns).join(Recording).where(Recording.campaign_id == campaign.id).distinct()
    stored = [Stored(*row) for row in session.execute(query)]
    changes = [
        change
        for row in sorted(stored, key=lambda row: row.name)
        if row.name in file.sensors
        for change in _changes(file.sensors[row.name], row)
    ]
    changes += _other_forces(file, stored)
    changes += _other_calibrations(session, campaign, file)
    if changes:
        listed = "; ".join(dict.fromkeys(changes))
        raise IngestError(
            f"{FILE}: {listed}: later figures of campaign {campaign.name!r} would not mean what "
            "the stored ones do; restore the stored values, or give this campaign another name"
        )


def _changes(sensor: Sensor, row: Stored) -> list[str]:
    pairs: list[tuple[str, object, object]] = []
    if sensor.quantity != row.quantity:
        pairs.append(("quantity", sensor.quantity, row.quantity))
    if not _close(sensor.conversion, (row.si_gain, row.si_offset)):
        offset = sensor.offset_v if sensor.sensitivity is not None else None
        pairs += [
            ("unit", sensor.unit, row.unit),
            ("sensitivity", sensor.sensitivity, row.sensitivity),
            ("offset_v", offset or None, row.offset_v or None),
        ]
    if not _close((sensor.range_si or 0.0,), (_full_scale_si(row),)):
        pairs.append(("range", sensor.range, row.full_scale))
    pairs += [
        (key, getattr(sensor, key), getattr(row, key))
        for key in ("position", "axis")
        if _other(sensor, row, key)
    ]
    return [
        difference(f"channels.{row.name}.{key}", _text(given), _text(stored))
        for key, given, stored in pairs
        if given != stored
    ]


def _other_calibrations(session: Session, campaign: Campaign, file: CampaignFile) -> list[str]:
    """Where points, date or uncertainty of a calibration are others, or it came or went."""
    query = select(RecordedChannel.name, RecordedChannel.header).join(Recording)
    volts = query.where(
        Recording.campaign_id == campaign.id, RecordedChannel.sensitivity.is_not(None)
    )
    changes = []
    for name, header in session.execute(volts):
        if name not in file.sensors:
            continue
        given, there = (
            _calibration(file.sensors[name].calibration),
            _calibration(calibration_of(header)),
        )
        if given != there:
            changes.append(difference(f"channels.{name}.calibration", given, there))
    return changes


def _calibration(calibration: Calibration | None) -> str | None:
    if calibration is None:
        return None
    line = calibration.line
    return (
        f"{calibration.points} points of {calibration.date} (sensitivity {line.sensitivity:.6g} "
        f"with u {line.sensitivity_u:.2g}, offset {line.offset:.6g} V with u {line.offset_u:.2g}, "
        f"common u {calibration.common_u:g})"
    )


def _other(sensor: Sensor, row: Stored, key: str) -> bool:
    given, stored = getattr(sensor, key) or "", getattr(row, key) or ""
    return bool(given.strip().casefold() != stored.strip().casefold())


def _full_scale_si(row: Stored) -> float:
    """Magnitude in SI; 0 where none is stored."""
    gain = row.si_gain * (1.0 if row.sensitivity is None else row.sensitivity)
    return abs((row.full_scale or 0.0) * gain)


def _close(first: tuple[float, ...], second: tuple[float, ...]) -> bool:
    return all(
        math.isclose(a, b, rel_tol=1e-9, abs_tol=0.0) for a, b in zip(first, second, strict=True)
    )


def _text(value: object) -> str | None:
    return None if value is None else printable(value)


def _other_forces(file: CampaignFile, stored: Sequence[Stored]) -> list[str]:
    given = sorted(sensor.name for sensor in file.sensors.values() if sensor.quantity == "force")
    there = sorted({row.name for row in stored if row.quantity == "force"})
    if not stored or given == there or not set(given) ^ set(there) - {row.name for row in stored}:
        return []
    return [f"force channels are {_names(given)} in {FILE}, {_names(there)} in the store"]


def _names(names: list[str]) -> str:
    return ", ".join(names) or "none"
