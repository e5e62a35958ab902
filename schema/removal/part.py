"""What is to be removed: a campaign, or one recording of it with its hits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from ..impacts import Impact, Pulse, Shot
from ..listings import get_campaign_id
from ..provenance import CAMPAIGN, RECORDING
from ..recordings import RecordedChannel, Recording

#: Keys of rows, to be used within another question.
Keys = Select[Any]


@dataclass(frozen=True)
class Part:
    """A campaign by its key, whole (`recording` is None) or one recording of it by its key, with
    its path."""

    campaign_id: int
    campaign: str
    recording_id: int | None = None
    recording: str | None = None

    @property
    def kind(self) -> str:
        return CAMPAIGN if self.recording_id is None else RECORDING

    @property
    def recordings(self) -> Keys:
        return self._of(Recording.id, Recording.campaign_id, Recording.id)

    @property
    def channels(self) -> Keys:
        return select(RecordedChannel.id).where(RecordedChannel.recording_id.in_(self.recordings))

    @property
    def impacts(self) -> Keys:
        return self._of(Impact.id, Impact.campaign_id, Impact.recording_id)

    @property
    def pulses(self) -> Keys:
        return select(Pulse.id).where(Pulse.impact_id.in_(self.impacts))

    @property
    def shots(self) -> Keys:
        return self._of(Shot.id, Shot.campaign_id, Shot.recording_id)

    def _of(self, key: Any, campaign: Any, recording: Any) -> Keys:
        if self.recording_id is None:
            return select(key).where(campaign == self.campaign_id)
        return select(key).where(campaign == self.campaign_id, recording == self.recording_id)


def campaign_part(session: Session, campaign: str) -> Part:
    """A whole campaign. Raises `LookupError` for an unknown one."""
    return Part(get_campaign_id(session, campaign), campaign)


def recording_part(session: Session, campaign: str, path: str) -> Part:
    """One recording of a campaign, stored or set aside. Raises `LookupError` for an unknown one."""
    key = get_campaign_id(session, campaign)
    recording = session.scalar(
        select(Recording.id).where(Recording.campaign_id == key, Recording.path == path)
    )
    if recording is None:
        paths = (
            select(Recording.path)
            .where(Recording.campaign_id == key)
            .order_by(Recording.path)
            .limit(_NAMED + 1)
        )
        there = list(session.scalars(paths))
        more = f" and more (pyroshock runs list {campaign})" if len(there) > _NAMED else ""
        raise LookupError(
            f"campaign {campaign!r} has no recording {path!r} in the store; there: "
            f"{', '.join(there[:_NAMED]) or 'none'}{more}"
        )
    return Part(key, campaign, recording, path)


def recording_of_runs(
    session: Session, campaign: str, runs: Sequence[int], repetition: int | None = None
) -> Part:
    """The recording that holds these runs, or one repetition of one run, and nothing else.

    Raises `LookupError` for runs that are not in the store, `ValueError` where they are in no
    recording, in several, or in one that holds other runs too: all of them would go.
    """
    key = get_campaign_id(session, campaign)
    hits = _hits(session, key)
    meant = {hit for hit in hits if hit[0] in runs and repetition in (None, hit[1])}
    what = (
        _enumerated(runs) if repetition is None else f"{_enumerated(runs)}, repetition {repetition}"
    )
    missing = sorted(set(runs) - {run for run, _ in meant})
    if missing:
        raise LookupError(
            f"campaign {campaign!r} has no {_enumerated(missing)} in the "
            f"store (pyroshock runs list)"
        )
    recordings = {hits[hit] for hit in meant}
    if None in recordings:
        raise ValueError(
            f"{what} of campaign {campaign!r} came from a row without a "
            f"recording; only recordings go"
        )
    paths = dict(
        iter(
            session.execute(
                select(Recording.id, Recording.path).where(Recording.campaign_id == key)
            )
        )
    )
    if len(recordings) > 1:
        names = ", ".join(
            sorted(paths[recording] for recording in recordings if recording is not None)
        )
        raise ValueError(
            f"{what} of campaign {campaign!r} is in several recordings ({names}); name one of them"
        )
    (recording,) = recordings
    assert recording is not None
    others = sorted(hit for hit, own in hits.items() if own == recording and hit not in meant)
    if others:
        also = ", ".join(f"{run}, repetition {number}" for run, number in others[:_NAMED])
        raise ValueError(
            f"recording {paths[recording]!r} holds other hits too: run "
            f"{also}{' …' if len(others) > _NAMED else ''}; "
            "they would go with it: name every run (--run N --run M), or the recording itself"
        )
    return Part(key, campaign, recording, paths[recording])


def list_recordings(session: Session, campaign: str) -> list[dict[str, Any]]:
    """Recordings of a campaign by path: status, SHA-256 of the file, and runs as "7 (1-10)" with
    their repetitions.

    Raises `LookupError` for an unknown campaign.
    """
    key = get_campaign_id(session, campaign)
    runs: dict[int | None, dict[int, list[int]]] = {}
    for (run, repetition), recording in sorted(_hits(session, key).items()):
        runs.setdefault(recording, {}).setdefault(run, []).append(repetition)
    columns = (Recording.id, Recording.path, Recording.status, Recording.sha256)
    query = select(*columns).where(Recording.campaign_id == key).order_by(Recording.path)
    return [
        {
            "recording": path,
            "status": status,
            "sha256": sha256,
            "runs": [
                f"{run} ({_span(numbers)})" for run, numbers in runs.get(recording, {}).items()
            ],
        }
        for recording, path, status, sha256 in session.execute(query)
    ]


def _span(numbers: Sequence[int]) -> str:
    whole = len(numbers) > 1 and numbers[-1] - numbers[0] == len(numbers) - 1
    return f"{numbers[0]}-{numbers[-1]}" if whole else ", ".join(map(str, numbers))


#: So many things are named in an error.
_NAMED = 8


def _hits(session: Session, campaign: int) -> dict[tuple[int, int], int | None]:
    """(run, repetition) -> key of its recording; a shot and its impact are of one recording."""
    hits: dict[tuple[int, int], int | None] = {}
    for table in (Impact, Shot):
        query = select(table.run, table.repetition, table.recording_id).where(
            table.campaign_id == campaign
        )
        for run, repetition, recording in session.execute(query):
            hits[run, repetition] = recording
    return hits


def _enumerated(runs: Sequence[int]) -> str:
    return f"run{'s' if len(runs) > 1 else ''} {', '.join(map(str, sorted(runs)))}"
