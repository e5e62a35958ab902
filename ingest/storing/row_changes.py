"""What rows of `runs.csv` say otherwise than the stored rows of their numbers, every value with
both: changes are refused, factors that the store lacks are additions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.campaigns import Configuration, ConfigurationLevel, Factor, FactorLevel
from ...schema.configurations import configuration_fingerprint
from ...schema.corrected_facts import list_corrections
from ...schema.known_factors import column_of
from ...schema.recordings import STORED
from ..errors import IngestError, difference
from ..extraction.gunshot import reported_uncertainty
from ..folder.campaign_file import CampaignFile
from ..folder.runs_table import RunRow
from .bench_changes import corrected_words
from .stored_rows import RecordingState, StoredRow, reported_velocity

#: Run and repetition.
HitKey = tuple[int, int]


def _row_values(row: RunRow, kind: str) -> dict[str, float | None]:
    """What `stored_rows` has as the values of this very row."""
    speed, speed_u = row.impact_velocity_m_s, row.impact_velocity_u_m_s
    values = reported_velocity("impact", None if speed is None else "reported", speed, speed_u)
    if kind != "gun":
        return values
    measured = row.measured_velocity_m_s
    reported = reported_velocity(
        "measured", None if measured is None else "reported", measured, reported_uncertainty(row)
    )
    return reported | values | {"bullet_length_m": row.bullet_length_m}


class RowDifferences:
    """Rows of `runs.csv` beside the stored ones of their numbers; each stored combination of
    factors is read once."""

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self._factors: dict[str, dict[str, str]] = {}

    def changes(self, session: Session, row: RunRow, stored: StoredRow) -> list[str]:
        """What a row says otherwise than the stored one: "tip_radius is 0.02 m, 0.01 m in the
        store"; none where equal.

        A factor that the stored row lacks is an addition, and no change.
        """
        factors = [
            difference(*factor)
            for factor in self._of_factors(session, row, stored)
            if factor[2] is not None
        ]
        values = _row_values(row, self._kind)
        return factors + [
            difference(key, _text(value), _text(stored.values[key]))
            for key, value in values.items()
            if value != stored.values[key]
        ]

    def added_factors(self, session: Session, row: RunRow, stored: StoredRow) -> tuple[str, ...]:
        """Names of the factors that the row has and the stored one lacks."""
        return tuple(
            name for name, _, there in self._of_factors(session, row, stored) if there is None
        )

    def _of_factors(
        self, session: Session, row: RunRow, stored: StoredRow
    ) -> list[tuple[str, str | None, str | None]]:
        if configuration_fingerprint(row.levels) == stored.factors:
            return []
        if stored.factors not in self._factors:
            self._factors[stored.factors] = _stored_factors(session, stored.factors)
        there = self._factors[stored.factors]
        given = {level.factor: _level(level.label, level.si_unit) for level in row.levels}
        names = sorted({*given, *there})
        return [(n, given.get(n), there.get(n)) for n in names if given.get(n) != there.get(n)]


def refuse_changed_rows(
    session: Session,
    file: CampaignFile,
    rows: Iterable[RunRow],
    stored_rows: Mapping[tuple[int, int], StoredRow],
    recordings: Mapping[str, RecordingState],
    differences: RowDifferences,
) -> None:
    """Raise `IngestError` for a row that is in the store with other values, or from another
    recording."""
    for row in rows:
        where = f"{row.place}: run {row.run}, repetition {row.repetition}"
        stored = stored_rows.get((row.run, row.repetition))
        if stored is None:
            path = row.recording or ""
            if path in recordings and recordings[path].status == STORED:
                raise IngestError(
                    f"{where}: {path} is in the store already, without this row; give it back its "
                    f"rows, {way_out(file.name, path)}"
                )
        elif stored.recording != row.recording:
            source = stored.recording or "a row without recording"
            replace = (
                ""
                if None in (stored.recording, row.recording)
                else f", {way_out(file.name, source, row.recording)}"
            )
            raise IngestError(
                f"{where} is in the store from {source}; give this one a number of its own{replace}"
            )
        elif changes := differences.changes(session, row, stored):
            replace = (
                "" if stored.recording is None else f", {way_out(file.name, stored.recording)}"
            )
            columns = [column_of(change.split(" is ")[0])[0] for change in changes]
            corrected = corrected_words(list_corrections(session, [file.name]), columns)
            raise IngestError(
                f"{where} is in the store with other factors, velocity or "
                f"bullet: {'; '.join(changes)}{corrected}; "
                f"restore the stored values, or give the corrected run a number of its own{replace}"
            )


def way_out(campaign: str, recording: str, other: str | None = None) -> str:
    """The command that puts what the folder holds, or its `other` file, in the place of a stored
    recording."""
    source = "--from FOLDER" if other is None else f"FOLDER/{other}"
    return f"or replace it: pyroshock runs replace {campaign} {recording} {source} --reason TEXT"


def _stored_factors(session: Session, fingerprint: str) -> dict[str, str]:
    query = select(Factor.name, FactorLevel.label, Factor.si_unit).join(
        FactorLevel, FactorLevel.factor_id == Factor.id
    )
    query = query.join(ConfigurationLevel, ConfigurationLevel.level_id == FactorLevel.id)
    query = query.join(Configuration, ConfigurationLevel.configuration_id == Configuration.id)
    return {
        name: _level(label, unit)
        for name, label, unit in session.execute(
            query.where(Configuration.fingerprint == fingerprint)
        )
    }


def _level(label: str, unit: str | None) -> str:
    return f"{label} {unit}" if unit else label


def _text(value: float | None) -> str | None:
    return None if value is None else repr(value)


def row_additions(
    session: Session,
    rows: Sequence[RunRow],
    stored_rows: Mapping[HitKey, StoredRow],
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


def _same_row(first: StoredRow, second: StoredRow) -> bool:
    return (first.recording, first.factors) == (second.recording, second.factors)
