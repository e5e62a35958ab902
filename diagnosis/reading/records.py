"""The raw series of the chosen hits, each recording's channels asked for once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from sqlalchemy import select
from sqlalchemy.orm import Session

from ...schema.recordings import RecordedChannel
from ..record import Series
from .impacts import Hit
from .quality_exclusions import Doubts
from .series import Window, cut_accelerations, cut_force, cut_ringing, is_on_plate, windows

_AT_ONCE = 500  # SQLite allows a limited number of variables


@dataclass(eq=False)
class Records:
    """Series by a hit's place in the order of runs, and what happened on the way.

    `rejected` counts hits by channel that a quality check said not to use; `double_hits` and `turned` are places, as is
    `rung_alone`: hits whose accelerations were recorded and their force was not.
    """

    force: dict[int, Series] = field(default_factory=dict)
    accelerations: dict[int, dict[str, Series]] = field(default_factory=dict)
    rejected: dict[str, int] = field(default_factory=dict)
    double_hits: list[int] = field(default_factory=list)
    turned: list[int] = field(default_factory=list)
    cells: int = 0
    chosen: int = 0
    of_impactor: set[str] = field(default_factory=set)
    rung_alone: list[int] = field(default_factory=list)

    def left_out(self, channel: str) -> None:
        """Count one hit more."""
        self.rejected[channel] = self.rejected.get(channel, 0) + 1


def read_records(
    session: Session, hits: Sequence[Hit], chosen: Sequence[int], ringing: Sequence[int], doubts: Doubts
) -> Records:
    """Force and accelerations of the hits at the places `chosen`; accelerations alone of those at `ringing`, which have
    no pulse, where no force was recorded that could have shown one."""
    found, cuts = Records(chosen=len(chosen)), windows(hits)
    channels = _channels(session, sorted({hits[i].recording_id or 0 for i in (*chosen, *ringing)}))
    for i in chosen:
        rows = channels.get(hits[i].recording_id or 0, [])
        found.double_hits += [i] if hits[i].impact_id in doubts.double_hits else []
        _take_accelerations(session, found, i, cuts[i], rows, doubts)
        _take_force(session, found, i, cuts[i], [row for row in rows if row.quantity == "force"], doubts)
    for i in ringing:
        rows = channels.get(hits[i].recording_id or 0, [])
        if not any(row.quantity == "force" for row in rows):
            _take_ringing(session, found, i, hits[i], rows, doubts)
    return found


def _take_ringing(
    session: Session, found: Records, place: int, hit: Hit, rows: Sequence[RecordedChannel], doubts: Doubts
) -> None:
    accelerations = [row for row in rows if row.quantity == "acceleration"]
    found.of_impactor |= {row.name for row in accelerations if not is_on_plate(row)}
    good = [row for row in accelerations if is_on_plate(row) and not doubts.rejects(hit, row.name)]
    cut = {
        name: series
        for name, series in cut_ringing(session, good).items()
        if not doubts.cut_top(hit, name, series.values)
    }
    if cut:
        found.accelerations[place] = cut
        found.rung_alone.append(place)


def _take_force(
    session: Session, found: Records, place: int, window: Window, cells: Sequence[RecordedChannel], doubts: Doubts
) -> None:
    found.cells = max(found.cells, len(cells))
    rejected = [row for row in cells if doubts.rejects(window.hit, row.name)]
    for row in rejected:
        found.left_out(row.name)
    force = None if rejected else cut_force(session, cells, window)  # a sum lacks what one cell of its array lacks
    if force is not None:
        found.force[place] = force[0]
        found.turned += [place] if force[1] else []


def _take_accelerations(
    session: Session, found: Records, place: int, window: Window, rows: Sequence[RecordedChannel], doubts: Doubts
) -> None:
    accelerations = [row for row in rows if row.quantity == "acceleration"]
    found.of_impactor |= {row.name for row in accelerations if not is_on_plate(row)}
    for name, series in cut_accelerations(session, [row for row in accelerations if is_on_plate(row)], window).items():
        if doubts.rejects(window.hit, name) or doubts.cut_top(window.hit, name, series.values):
            found.left_out(name)
        else:
            found.accelerations.setdefault(place, {})[name] = series


def _channels(session: Session, recordings: Sequence[int]) -> dict[int, list[RecordedChannel]]:
    """Rows of channels by recording, by name within it."""
    found: dict[int, list[RecordedChannel]] = {}
    query = select(RecordedChannel).order_by(RecordedChannel.recording_id, RecordedChannel.name)
    for i in range(0, len(recordings), _AT_ONCE):
        some = query.where(RecordedChannel.recording_id.in_(recordings[i : i + _AT_ONCE]))
        for row in session.scalars(some):
            found.setdefault(row.recording_id, []).append(row)
    return found
