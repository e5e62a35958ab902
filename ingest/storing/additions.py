"""Facts that a stored campaign lacked and its folder has now: of the bench, and factors of rows.
They are added.

A fact that the store has stays as it is (`bench_changes`, `row_changes`). Figures, pulses and
verdicts of stored impacts are not made anew; datasets that are frozen keep the facts that they were
frozen with (`schema.frozen_facts`).
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

from sqlalchemy import bindparam, select, update
from sqlalchemy.orm import Session

from ...schema.campaigns import Campaign
from ...schema.configurations import configuration_ids
from ...schema.frozen_facts import freeze_facts
from ...schema.impacts import Impact, Shot
from ...schema.session import Store
from ..folder.campaign_file import CampaignFile
from ..folder.modal_table import ModalTableFile
from ..folder.runs_table import RunRow
from .bench_changes import bench_additions
from .bench_rows import campaign_values
from .row_changes import HitKey


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
