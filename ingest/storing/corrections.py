"""Facts of a stored campaign added or corrected with a reason: of its bench, and factors of its
runs.

The earlier value is kept beside the new one. Figures, pulses and findings of stored impacts are not
made anew, and datasets keep the facts that they were built with (`schema.frozen_facts`).
"""

from __future__ import annotations

import datetime as dt
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from sqlalchemy import bindparam, select, update
from sqlalchemy.orm import Session

from ...schema.benches import Material, ModalTable, material_names
from ...schema.campaigns import (
    Campaign,
    Configuration,
    ConfigurationLevel,
    Factor,
    FactorLevel,
)
from ...schema.configurations import configuration_ids
from ...schema.corrections import FactCorrection
from ...schema.frozen_facts import freeze_facts
from ...schema.impacts import Impact, Shot
from ...schema.known_factors import BY_COLUMN, BY_NAME, LevelError, RunLevel, column_of, level_of
from ...schema.known_facts import facts_from_json
from ...schema.session import Store
from ..errors import Faults, IngestError, enumerated, parse_date, printable
from ..folder.campaign_file import BenchParts, campaign_fingerprint, read_bench
from ..folder.column_names import MEASURED
from ..folder.description_fields import BENCH, FACTS, DescribedKey
from ..folder.typed_values import number_of, outline_of, plain_text
from .bench_rows import bench_keys
from .row_changes import HitKey
from .stated_bench import stated_bench

#: Of the campaign itself; its name is what everything else calls it.
OF_CAMPAIGN = {key.name: key for key in FACTS if key.keys[-1] != "name"}
#: Of its bench. The regulator's limit judges rows when they are read, and is not stored; a modal
#: table is a file.
OF_BENCH = {
    key.name: key for key in BENCH if key.keys[-1] not in ("max_regulated_pressure_pa", "modes")
}
#: Factors of runs, by the column of runs.csv.
OF_RUNS = tuple(BY_COLUMN)
#: The file that the contract of a campaign folder names for a modal table.
_MODES = "plate_modes.csv"


@dataclass(frozen=True)
class CorrectedFact:
    """One fact that was corrected: what was stated before, each value with its hits (none of a fact
    of the campaign), and what is stated now."""

    fact: str
    earlier: tuple[tuple[str | None, tuple[HitKey, ...]], ...]
    value: str


def correct_facts(
    store: Store,
    session: Session,
    campaign: str,
    facts: Mapping[str, str],
    reason: str,
    runs: Collection[int] = (),
    *,
    only_missing: bool = False,
) -> tuple[CorrectedFact, ...]:
    """Write facts into a stored campaign, with a row for each that keeps the earlier value.

    Parameters:
        store: The store, whose writer signs the rows.
        session: A session that writes to it.
        campaign: The name of the campaign.
        facts: Names of facts, as campaign.toml and runs.csv call them, with their values as a
            person types them ("12 mm").
        reason: Why they are corrected; it is not empty.
        runs: The runs whose factors are corrected; none stands for all.
        only_missing: Whether factors that a run states already stay as they are.

    Returns:
        What was corrected; a fact that states the same already is left out.

    Raises:
        LookupError: For an unknown campaign or run.
        IngestError: For a fact that there is not, or a value that it cannot have.
    """
    row = session.scalars(select(Campaign).where(Campaign.name == campaign)).one_or_none()
    if row is None:
        raise LookupError(f"no campaign {campaign!r} in the store")
    faults = Faults()
    faults.add(_unknown(session, row, facts))
    faults.refuse()
    own = {name: text for name, text in facts.items() if name in (*OF_CAMPAIGN, *OF_BENCH)}
    levels = {
        name: faults.of(_level, session, name, text)
        for name, text in facts.items()
        if name not in own
    }
    faults.refuse()
    changes = [
        *_correct_campaign(session, row, own),
        *_correct_runs(session, row, levels, runs, only_missing=only_missing),
    ]
    if not changes:
        return ()
    names = enumerated([change.fact for change in changes])
    text = f"{store.writer.command} (corrected in campaign {row.name!r}: {names})"
    written_by = replace(store.writer, command=text).insert(session.connection())
    row.written_by_id = written_by
    now = dt.datetime.now(dt.UTC)
    session.add_all(
        FactCorrection(
            campaign_id=row.id,
            fact=change.fact,
            earlier=[
                {"value": value, "hits": [list(hit) for hit in hits]}
                for value, hits in change.earlier
            ],
            value=change.value,
            reason=reason,
            corrected_at=now,
            written_by_id=written_by,
        )
        for change in changes
    )
    session.flush()
    return tuple(changes)


def _unknown(session: Session, row: Campaign, names: Collection[str]) -> list[str]:
    """A fault for each name that is no fact of this campaign; a free factor is one that its runs
    have already."""
    usual = (*OF_CAMPAIGN, *OF_BENCH, *OF_RUNS)
    others = [name for name in names if name not in usual]
    if not others:
        return []
    stored = _levels(session, set(_hits(session, row).values()))
    free = {level.factor for levels in stored.values() for level in levels} - set(BY_NAME)
    fact_names = ", ".join((*usual, *sorted(free)))
    return [
        f"{name} cannot be corrected: figures were computed from it when the recording was read; "
        "replace the recording"
        if name in MEASURED
        else f"{printable(name)} is no fact of the campaign; known: {fact_names}"
        for name in others
        if name not in free
    ]


def _level(session: Session, column: str, text: str) -> RunLevel:
    factor = BY_COLUMN.get(column)
    typed: Any = text
    if factor is not None and factor.si_unit:
        # "0.03 m" of a column in mm is 30; a bare number is in the column's own unit
        number = number_of(text, "") if _is_bare(text) else number_of(text, factor.si_unit)
        typed = text
        if isinstance(number, float) and not _is_bare(text):
            typed = plain_text(float(f"{number / factor.scale:.12g}"))
    try:
        return level_of(column, str(typed).strip(), material_names(session))
    except LevelError as error:
        raise IngestError(f"{column} is {printable(text)}; expected {error}") from error


def _is_bare(text: str) -> bool:
    return isinstance(number_of(text, ""), float)


def _correct_campaign(
    session: Session, row: Campaign, facts: Mapping[str, str]
) -> list[CorrectedFact]:
    changes = []
    for name in [name for name in facts if name in OF_CAMPAIGN]:
        key = name.rpartition(".")[2]
        value: Any = facts[name].strip()
        if key == "date":
            try:
                value = parse_date(value, "an ISO date such as 2026-11-01")
            except ValueError as error:
                raise IngestError(f"{name} is {error}") from error
        earlier_value = getattr(row, key)
        if value != earlier_value:
            setattr(row, key, value)
            changes.append(CorrectedFact(name, ((_text(earlier_value), ()),), str(value)))
    bench = {name: facts[name] for name in facts if name in OF_BENCH}
    stated = stated_bench(session, row)
    wanted = {stage: dict(part) for stage, part in stated.items()}
    names = material_names(session)
    for name, text in bench.items():
        _, stage, key = OF_BENCH[name].keys
        value = _bench_value(OF_BENCH[name], text)
        if key == "material" and names(str(value)) is None:
            raise IngestError(
                f"{name} is {printable(text)}; expected a material of the store, which the list "
                "of materials has"
            )
        value = names(str(value)) if key == "material" else value
        earlier_value = stated.get(stage, {}).get(key)
        if value != earlier_value:
            wanted.setdefault(stage, {})[key] = value
            changes.append(CorrectedFact(name, ((_text(earlier_value), ()),), _text(value) or ""))
    if changes:
        parts = read_bench(_with_modes(row, wanted))
        if any(change.fact in OF_BENCH for change in changes):
            freeze_facts(session, row, (), bench=True)
            for column, value in bench_keys(session, parts, _modal_table(session, row)).items():
                setattr(row, column, value)
        row.fingerprint = _fingerprint(row, parts)
    return changes


def _bench_value(key: DescribedKey, text: str) -> Any:
    if key.keys[-1] == "outline_m":
        return outline_of(text)
    return number_of(text, key.unit) if key.is_number else text.strip()


def _with_modes(row: Campaign, bench: Mapping[str, Any]) -> dict[str, Any]:
    """A bench with the name of its modal table, where its plate has one."""
    if row.plate is None or row.plate.modal_table_id is None:
        return dict(bench)
    return {**bench, "plate": {**bench.get("plate", {}), "modes": _MODES}}


def _modal_table(session: Session, row: Campaign) -> tuple[int, str] | None:
    if row.plate is None or row.plate.modal_table_id is None:
        return None
    table = session.get_one(ModalTable, row.plate.modal_table_id)
    return table.id, table.fingerprint


def _fingerprint(row: Campaign, parts: BenchParts) -> str:
    return campaign_fingerprint(row.kind, row.date, parts, facts_from_json(row.known_facts))


def _text(value: Any) -> str | None:
    if value is None:
        return None
    if isinstance(value, list | tuple):
        return "; ".join(", ".join(plain_text(part) for part in corner) for corner in value)
    return plain_text(value)


def _correct_runs(
    session: Session,
    row: Campaign,
    levels: Mapping[str, RunLevel],
    runs: Collection[int],
    *,
    only_missing: bool,
) -> list[CorrectedFact]:
    if not levels:
        return []
    hits = _hits(session, row)
    if absent := sorted(set(runs) - {run for run, _ in hits}):
        raise LookupError(f"campaign {row.name!r} has no run {enumerated(list(map(str, absent)))}")
    stored = _levels(session, set(hits.values()))
    wanted: dict[HitKey, list[RunLevel]] = {}
    earlier: dict[str, dict[str | None, list[HitKey]]] = {name: {} for name in levels}
    for hit, configuration in sorted(hits.items()):
        if runs and hit[0] not in runs:
            continue
        own = {level.factor: level for level in stored[configuration]}
        for name, level in levels.items():
            earlier_level = own.get(level.factor)
            if earlier_level is not None and (only_missing or earlier_level.label == level.label):
                continue
            earlier[name].setdefault(_cell(earlier_level), []).append(hit)
            own[level.factor] = level
            wanted[hit] = list(own.values())
    if not wanted:
        return []
    freeze_facts(session, row, wanted, bench=False)
    _write_levels(session, row, wanted)
    return [
        CorrectedFact(
            name,
            tuple((value, tuple(own_hits)) for value, own_hits in values.items()),
            _cell(levels[name]) or "",
        )
        for name, values in earlier.items()
        if values
    ]


def _hits(session: Session, row: Campaign) -> dict[HitKey, int]:
    """(run, repetition) -> key of its configuration."""
    hits: dict[HitKey, int] = {}
    for table in (Impact, Shot):
        query = select(table.run, table.repetition, table.configuration_id)
        for run, repetition, key in session.execute(query.where(table.campaign_id == row.id)):
            hits[run, repetition] = key
    return hits


def _levels(session: Session, configurations: Collection[int]) -> dict[int, list[RunLevel]]:
    """The levels of configurations by their key."""
    query = (
        select(
            Configuration.id,
            Factor.name,
            FactorLevel.label,
            FactorLevel.number,
            Factor.si_unit,
            Material.name,
        )
        .outerjoin(ConfigurationLevel, ConfigurationLevel.configuration_id == Configuration.id)
        .outerjoin(FactorLevel, ConfigurationLevel.level_id == FactorLevel.id)
        .outerjoin(Factor, FactorLevel.factor_id == Factor.id)
        .outerjoin(Material, FactorLevel.material_id == Material.id)
    )
    levels: dict[int, list[RunLevel]] = {key: [] for key in configurations}
    for key in configurations:
        rows = session.execute(query.where(Configuration.id == key))
        for _, factor, label, number, si_unit, material in rows:
            if factor is not None:
                levels[key].append(RunLevel(factor, label, number, si_unit, material))
    return levels


def _cell(level: RunLevel | None) -> str | None:
    """A level as runs.csv writes it: 30 of a radius in mm."""
    if level is None:
        return None
    _, scale = column_of(level.factor)
    if level.number is None:
        return level.label
    return plain_text(float(f"{level.number / scale:.12g}"))


def _write_levels(
    session: Session, row: Campaign, wanted: Mapping[HitKey, Sequence[RunLevel]]
) -> None:
    keys = configuration_ids(session, list(wanted.values()))
    rows = [
        {
            "hit_run": run,
            "hit_repetition": repetition,
            "to": key,
            "mass": _number(levels, "bullet_mass"),
            "pressure": _number(levels, "tank_pressure"),
        }
        for ((run, repetition), levels), key in zip(wanted.items(), keys, strict=True)
    ]
    session.flush()
    for table in (Impact, Shot):
        values: dict[str, Any] = {"configuration_id": bindparam("to")}
        if table is Shot:  # which has them as columns of its own, too
            values |= {
                "bullet_mass_kg": bindparam("mass"),
                "tank_pressure_pa": bindparam("pressure"),
            }
        of_hit = (
            table.run == bindparam("hit_run"),
            table.repetition == bindparam("hit_repetition"),
        )
        change = update(table).where(table.campaign_id == row.id, *of_hit).values(**values)
        session.connection().execute(change, rows)


def _number(levels: Sequence[RunLevel], factor: str) -> float | None:
    return next((level.number for level in levels if level.factor == factor), None)
