"""Pulses cut anew from the stored series with other settings. Old versions stay; the new one is in use.

Accelerations are measured anew where a recording has no figures of them yet, or no force that says where its impacts
lie."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

from sqlalchemy import select
from sqlalchemy.orm import Session

from ..parallel.executor import HERE, LOCAL, Crew
from ..parallel.map_tasks import mapped
from ..schema.advisory_lock import take_turn
from ..schema.campaigns import Campaign
from ..schema.listings import get_campaign_id
from ..schema.recordings import STORED, Recording
from ..schema.series import SeriesError
from ..schema.session import Store
from ..signals.channel import Channel
from .recut import (
    Cut,
    acceleration_channels,
    add_versions,
    cut,
    cut_of,
    force_channels,
    has_figures,
    impacts_of,
    impacts_without_contact,
    put_in_use,
    replace_figures,
    versions,
)
from .settings import ExtractionSettings

#: Recordings under way at a time: a cluster of some dozen workers has enough to do.
_ON_A_CLUSTER = 64


@dataclass
class ReextractionReport:
    """What changed: pulses `added`, pulses of earlier versions put back in use, impacts whose accelerations were
    `measured` anew, recordings left as they were."""

    campaign: str
    added: int = 0
    reused: int = 0
    measured: int = 0
    skipped: list[dict[str, str]] = field(default_factory=list)

    def as_json(self) -> dict[str, object]:
        return {
            "campaign": self.campaign,
            "added": self.added,
            "reused": self.reused,
            "measured": self.measured,
            "skipped": self.skipped,
        }


def reextract(
    store: Store,
    campaign: str,
    settings: ExtractionSettings,
    progress: Callable[[int, int, str], None] | None = None,
    crew: Crew = HERE,
) -> ReextractionReport:
    """Cut every recording of `campaign` again, one transaction each. Raises `LookupError` for an unknown campaign.

    A recording in which the new settings find another number of impacts is skipped and named: which pulse belongs to
    which impact would be a guess. So is one with damaged samples. `crew` cuts; reading and storing stay here.
    """
    report = ReextractionReport(campaign)
    with store.reading() as session:
        query = select(Recording.id, Recording.path).where(
            Recording.campaign_id == get_campaign_id(session, campaign), Recording.status == STORED
        )
        recordings = [(key, path) for key, path in session.execute(query.order_by(Recording.id))]
    read = (_read(store, key, path, settings) for key, path in recordings)
    for done, (recording, pulses) in enumerate(mapped(crew, _cut, read, shared=(settings,), window=_window(crew)), 1):
        _keep(store, recording, pulses, settings, report)
        if progress:
            progress(done, len(recordings), recording.path)
    report.skipped.sort(key=lambda item: item["recording"])  # whoever was first
    return report


def reextract_recording(store: Store, recording_key: int, settings: ExtractionSettings) -> ReextractionReport:
    """`reextract` of one recording, with all its hits. Raises as `preview_impacts`."""
    with store.reading() as session:
        campaign, path, _ = _recording(session, recording_key)
    report = ReextractionReport(campaign)
    recording = _read(store, recording_key, path, settings)
    _keep(store, recording, _cut(recording, settings), settings, report)
    return report


def preview_impacts(store: Store, recording_key: int, settings: ExtractionSettings) -> Cut:
    """What `reextract_recording` would store of a recording; nothing is.

    Raises `LookupError` for a recording that there is not, was set aside, or in which no contact was found.
    """
    with store.reading() as session:
        _, _, impacts = _recording(session, recording_key)
        return cut(session, recording_key, impacts, settings)


def _recording(session: Session, key: int) -> tuple[str, str, list[int]]:
    """Its campaign, its path and the impacts that can be cut."""
    columns = (Campaign.name, Recording.path, Recording.status, Recording.reason)
    row = session.execute(select(*columns).join(Campaign).where(Recording.id == key)).one_or_none()
    if row is None:
        raise LookupError(f"no recording {key} in the store; pyroshock show IMPACT names those of impacts")
    campaign, path, status, reason = row
    if status != STORED:
        raise LookupError(f"recording {path!r} of campaign {campaign!r} was {status}, nothing to cut: {reason}")
    impacts = impacts_of(session, key)
    if not impacts:
        raise LookupError(f"recording {path!r} of campaign {campaign!r} has no impact with a contact to cut")
    return campaign, path, impacts


@dataclass(frozen=True)
class _Read:
    """A recording as it is cut, wherever that is. `channels` is None where nothing is to be cut; `damage` says why.

    `contacts`: its impacts are contacts of a force; else they are shocks of its accelerations.
    """

    key: int
    path: str
    impacts: tuple[int, ...]
    channels: tuple[Channel, ...] | None = None
    damage: str | None = None
    contacts: bool = True


def _window(crew: Crew) -> int:
    """Recordings that are in memory at a time."""
    if crew.is_here:
        return 1
    return 4 * crew.jobs if crew.backend == LOCAL else _ON_A_CLUSTER


def _read(store: Store, key: int, path: str, settings: ExtractionSettings) -> _Read:
    with store.reading() as session:
        impacts = tuple(impacts_of(session, key))
        try:
            if not impacts:
                impacts = tuple(impacts_without_contact(session, key))
                channels = acceleration_channels(session, key) if impacts else ()
                return _Read(key, path, impacts if channels else (), channels or None, contacts=False)
            accelerations = () if has_figures(session, impacts) else acceleration_channels(session, key)
            if not accelerations and len(versions(session, impacts, settings)) == len(impacts):
                return _Read(key, path, impacts)
            return _Read(key, path, impacts, (*force_channels(session, key), *accelerations))
        except SeriesError as error:
            return _Read(key, path, impacts, damage=str(error))


def _cut(one: _Read, settings: ExtractionSettings) -> Cut | None:
    return None if one.channels is None else cut_of(one.channels, one.impacts, settings)


def _keep(
    store: Store, one: _Read, found: Cut | None, settings: ExtractionSettings, report: ReextractionReport
) -> None:
    if found is not None and not one.contacts:
        _keep_figures(store, one, found, report)
        return
    reason = one.damage or (found and found.mismatch)
    if reason:
        report.skipped.append({"recording": one.path, "reason": reason})
    elif one.impacts:
        write = partial(_stored, recording=one.key, impacts=one.impacts, settings=settings, found=found)
        added, reused, measured = store.write(write, idempotent=True)
        report.added += added
        report.reused += reused
        report.measured += measured


def _keep_figures(store: Store, one: _Read, found: Cut, report: ReextractionReport) -> None:
    """The figures of a recording of accelerations alone."""
    if len(found.figures) != len(one.impacts):
        reason = f"not as many shocks found in its accelerations as the {len(one.impacts)} impacts that are stored"
        report.skipped.append({"recording": one.path, "reason": reason})
        return
    write = partial(replace_figures, recording=one.key, impacts=one.impacts, figures=found.figures)
    report.measured += store.write(write, idempotent=True)


def _stored(
    session: Session, recording: int, impacts: Sequence[int], settings: ExtractionSettings, found: Cut | None
) -> tuple[int, int, int]:
    """Pulses added, and put back in use; impacts whose accelerations were measured."""
    take_turn(session, f"recording {recording}")
    # Asked again in our turn: a second request for the same may have been faster.
    measured = 0
    if found is not None and found.figures and not has_figures(session, impacts):
        measured = replace_figures(session, recording, impacts, found.figures)
    earlier = versions(session, impacts, settings)
    if found is None or len(earlier) == len(impacts):
        put_in_use(session, impacts, earlier)
        return 0, len(earlier), measured
    add_versions(session, found)
    return len(found.pulses), 0, measured
