"""A row of `runs.csv` beside the stored one of its number: every value that differs, with both."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from sqlalchemy import select
from sqlalchemy.orm import Session

from ..schema.campaigns import Configuration, ConfigurationLevel, Factor, FactorLevel
from ..schema.configurations import configuration_fingerprint
from ..schema.recordings import STORED
from .errors import IngestError, difference
from .folder import CampaignFile
from .runs import RunRow
from .stored_rows import KnownRecording, KnownRow, reported_uncertainty, reported_velocity


def row_values(row: RunRow, kind: str) -> dict[str, float | None]:
    """What `known_rows` has as the values of this very row."""
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
    """Rows of `runs.csv` beside the stored ones of their numbers; each stored combination of factors is read once."""

    def __init__(self, kind: str) -> None:
        self._kind = kind
        self._factors: dict[str, dict[str, str]] = {}

    def changes(self, session: Session, row: RunRow, stored: KnownRow) -> list[str]:
        """What a row says otherwise than the stored one: "tip_radius is 0.02 m, 0.01 m in the store"; none where equal.

        A factor that the stored row lacks is an addition, and no change.
        """
        factors = [difference(*factor) for factor in self._of_factors(session, row, stored) if factor[2] is not None]
        values = row_values(row, self._kind)
        return factors + [
            difference(key, _text(value), _text(stored.values[key]))
            for key, value in values.items()
            if value != stored.values[key]
        ]

    def added_factors(self, session: Session, row: RunRow, stored: KnownRow) -> tuple[str, ...]:
        """Names of the factors that the row has and the stored one lacks."""
        return tuple(name for name, _, there in self._of_factors(session, row, stored) if there is None)

    def _of_factors(self, session: Session, row: RunRow, stored: KnownRow) -> list[tuple[str, str | None, str | None]]:
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
    known_rows: Mapping[tuple[int, int], KnownRow],
    recordings: Mapping[str, KnownRecording],
    differences: RowDifferences,
) -> None:
    """Raise `IngestError` for a row that is in the store with other values, or from another recording."""
    for row in rows:
        where = f"{row.place}: run {row.run}, repetition {row.repetition}"
        stored = known_rows.get((row.run, row.repetition))
        if stored is None:
            path = row.recording or ""
            if path in recordings and recordings[path].status == STORED:
                raise IngestError(
                    f"{where}: {path} is in the store already, without this row; give it back its rows, "
                    f"{way_out(file.name, path)}"
                )
        elif stored.recording != row.recording:
            source = stored.recording or "a row without recording"
            replace = (
                "" if None in (stored.recording, row.recording) else f", {way_out(file.name, source, row.recording)}"
            )
            raise IngestError(f"{where} is in the store from {source}; give this one a number of its own{replace}")
        elif changes := differences.changes(session, row, stored):
            replace = "" if stored.recording is None else f", {way_out(file.name, stored.recording)}"
            raise IngestError(
                f"{where} is in the store with other factors, velocity or bullet: {'; '.join(changes)}; "
                f"restore the stored values, or give the corrected run a number of its own{replace}"
            )


def way_out(campaign: str, recording: str, other: str | None = None) -> str:
    """The command that puts what the folder holds, or its `other` file, in the place of a stored recording."""
    source = "--from FOLDER" if other is None else f"FOLDER/{other}"
    return f"or replace it: pyroshock runs replace {campaign} {recording} {source} --reason TEXT"


def _stored_factors(session: Session, fingerprint: str) -> dict[str, str]:
    query = select(Factor.name, FactorLevel.label, Factor.si_unit).join(FactorLevel, FactorLevel.factor_id == Factor.id)
    query = query.join(ConfigurationLevel, ConfigurationLevel.level_id == FactorLevel.id)
    query = query.join(Configuration, ConfigurationLevel.configuration_id == Configuration.id)
    return {
        name: _level(label, unit)
        for name, label, unit in session.execute(query.where(Configuration.fingerprint == fingerprint))
    }


def _level(label: str, unit: str | None) -> str:
    return f"{label} {unit}" if unit else label


def _text(value: float | None) -> str | None:
    return None if value is None else repr(value)
