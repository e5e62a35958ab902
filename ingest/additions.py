"""Facts that a stored campaign lacked and its folder has now: of the bench, and factors of rows. They are added.

A fact that the store has stays as it is (`changed_bench`, `changed_rows`). Figures, pulses and verdicts of stored
impacts are not made anew; datasets that are frozen keep the facts that they were frozen with (`schema.frozen_facts`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from sqlalchemy import bindparam, select, update
from sqlalchemy.orm import Session

from ..schema.campaigns import Campaign
from ..schema.configurations import configuration_ids
from ..schema.frozen_facts import keep_facts
from ..schema.impacts import Impact
from ..schema.session import Store
from ..schema.shots import Shot
from .changed_rows import RowDifferences
from .folder import CampaignFile
from .modes import ModalTableFile
from .rows import bench_additions, campaign_values
from .runs import RunRow
from .stored_rows import KnownRow

#: Run and repetition.
HitKey = tuple[int, int]


@dataclass(frozen=True)
class Additions:
    """Facts of the bench ("bench.hammer.mass_kg = 0.32"), and for each row with new factors the stored hits that it
    stands for and the names of the factors."""

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
        return "; ".join([*self.bench, *(f"{name} of {count} {what}" for name, count in sorted(counts.items()))])


def row_additions(
    session: Session, rows: Sequence[RunRow], stored_rows: Mapping[HitKey, KnownRow], differences: RowDifferences
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
                hits = [key for key, other in stored_rows.items() if key[0] == row.run and _same_row(other, stored)]
            added.append((row, tuple(sorted(hits)), names))
    return tuple(added)


def _same_row(first: KnownRow, second: KnownRow) -> bool:
    return (first.recording, first.factors) == (second.recording, second.factors)


def add_facts(
    store: Store, session: Session, file: CampaignFile, modes: ModalTableFile | None, additions: Additions
) -> None:
    """Write what is added, with a row of provenance that says what; nothing where another process has added it."""
    campaign = session.scalars(select(Campaign).where(Campaign.name == file.name)).one()
    bench = bool(bench_additions(session, campaign, file))
    table: type[Impact] | type[Shot] = Shot if campaign.kind == "gun" else Impact
    configurations = configuration_ids(session, [row.levels for row, _, _ in additions.rows])
    there = select(table.run, table.repetition, table.configuration_id).where(table.campaign_id == campaign.id)
    stored = {(run, repetition): key for run, repetition, key in session.execute(there)} if additions.rows else {}
    wanted = {
        hit: configuration
        for (_, hits, _), configuration in zip(additions.rows, configurations, strict=True)
        for hit in hits
        if stored.get(hit) not in (None, configuration)
    }
    if not bench and not wanted:
        return
    keep_facts(session, campaign, wanted, bench=bench)
    text = f"{store.writer.command} (added to campaign {file.name!r}: {additions.words(file.kind)})"
    written_by = replace(store.writer, command=text).insert(session.connection())
    campaign.written_by_id = written_by
    if bench:
        for name, value in campaign_values(session, file, modes).items():
            if name.endswith("_id") or name == "fingerprint":
                setattr(campaign, name, value)
    session.flush()
    hits = [{"hit_run": run, "hit_repetition": repetition, "to": key} for (run, repetition), key in wanted.items()]
    for hit_table in (Impact, Shot) if hits else ():
        of_hit = (hit_table.run == bindparam("hit_run"), hit_table.repetition == bindparam("hit_repetition"))
        rows = update(hit_table).where(hit_table.campaign_id == campaign.id, *of_hit)
        rows = rows.values(configuration_id=bindparam("to"), written_by_id=written_by)
        session.connection().execute(rows, hits)
