"""Pulses extracted again from the stored series with other settings: looked at, or stored as the
version in use. Old versions stay.

Accelerations are measured anew where a recording has no figures of them yet, or no force that says
where its impacts lie.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial

from sqlalchemy import delete, func, select, update
from sqlalchemy.orm import Session

from ...parallel.executor import HERE, LOCAL, ExecutorConfig
from ...parallel.map_tasks import run_all_tasks
from ...schema.campaigns import Campaign
from ...schema.impacts import ChannelFigures, Impact
from ...schema.impacts import Pulse as PulseRow
from ...schema.listings import get_campaign_id
from ...schema.recordings import STORED, Recording
from ...schema.series import SeriesError
from ...schema.session import Store
from ...schema.transactions import take_advisory_lock
from ...signals.channel import Channel
from ..extraction.channel_figures import ImpactFigures, figure_rows, measure_channels
from ..extraction.pulses import ExtractedPulse
from ..extraction.recording import hits_of
from ..extraction.settings import ExtractionSettings
from .row_values import pulse_values, settings_id
from .stored_channels import list_channels, read_channel


@dataclass(frozen=True)
class HitReextraction:
    """What settings make of a recording: keys of its impacts in the order of their contacts, and
    the pulses found.

    Each impact has its pulse where `mismatch` is None; else it says why nobody can tell which
    belongs to which. `figures` are those of the acceleration channels for each impact, where they
    were read too.
    """

    settings: ExtractionSettings
    impacts: tuple[int, ...]
    pulses: tuple[ExtractedPulse, ...]
    figures: tuple[ImpactFigures, ...] = ()

    @property
    def mismatch(self) -> str | None:
        if len(self.pulses) == len(self.impacts):
            return None
        return f"{len(self.pulses)} impacts found with these settings, {len(self.impacts)} stored"

    def pulse_of(self, impact: int) -> ExtractedPulse | None:
        """The pulse of an impact; None where they cannot be told apart, or it is another
        recording's.

        Parameters:
            impact: The key of the impact.
        """
        if self.mismatch is not None or impact not in self.impacts:
            return None
        return self.pulses[self.impacts.index(impact)]


def impacts_of(session: Session, recording: int) -> list[int]:
    """Impacts of a recording in the order of their contacts; those without a contact are left out.

    Parameters:
        session: A session of the store.
        recording: The key of the recording.

    Returns:
        The keys of the impacts.
    """
    query = (
        select(Impact.id)
        .join(PulseRow, PulseRow.impact_id == Impact.id)
        .where(Impact.recording_id == recording)
        .group_by(Impact.id)
        .order_by(func.min(PulseRow.start_s))
    )
    return list(session.scalars(query))


def reextract_stored_hits(
    session: Session, recording: int, impacts: Sequence[int], settings: ExtractionSettings
) -> HitReextraction:
    """The recording's hits by other settings; nothing is stored.

    Parameters:
        session: A session of the store.
        recording: The key of the recording.
        impacts: The keys of its impacts, in the order of their contacts.
        settings: How pulses are cut out.

    Raises:
        SeriesError: As `force_channels`.
    """
    return reextract_recording_hits(force_channels(session, recording), impacts, settings)


def force_channels(session: Session, recording: int) -> tuple[Channel, ...]:
    """What contacts are looked for in.

    Parameters:
        session: A session of the store.
        recording: The key of the recording.

    Returns:
        The force channels of the recording, with all samples.

    Raises:
        SeriesError: Where samples are damaged.
    """
    return _channels(session, recording, "force")


def reextract_recording_hits(
    channels: Sequence[Channel], impacts: Sequence[int], settings: ExtractionSettings
) -> HitReextraction:
    """`reextract_stored_hits` of samples that were read; without the store.

    Parameters:
        channels: The force channels of the recording, and its acceleration channels where figures
            are wanted too.
        impacts: The keys of its impacts, in the order of time.
        settings: How pulses are cut out.
    """
    hits = hits_of(list(channels), settings, len(impacts))
    figures = measure_channels(channels, hits, len(impacts), settings)
    return HitReextraction(settings, tuple(impacts), hits.pulses, figures.impacts)


def stored_versions(
    session: Session, impacts: Sequence[int], settings: ExtractionSettings
) -> list[int]:
    """Pulses that were already cut with some settings.

    Parameters:
        session: A session of the store.
        impacts: The keys of the impacts.
        settings: How the pulses were cut out.

    Returns:
        The keys of the pulses.
    """
    query = select(PulseRow.id).join(PulseRow.settings).where(PulseRow.impact_id.in_(impacts))
    return list(
        session.scalars(query.where(PulseRow.settings.has(fingerprint=settings.fingerprint)))
    )


def put_in_use(session: Session, impacts: Sequence[int], pulses: Sequence[int]) -> None:
    """Make versions of pulses the ones in use.

    Parameters:
        session: A session that writes to the store.
        impacts: The keys of the impacts, whose pulses in use until now are so no more.
        pulses: The keys of the pulses that come into use, at most one of each impact.
    """
    _retire(session, impacts)
    session.execute(update(PulseRow).where(PulseRow.id.in_(pulses)).values(current=True))


def add_versions(session: Session, hits: HitReextraction) -> None:
    """Store pulses as the versions in use.

    Parameters:
        session: A session that writes to the store.
        hits: The pulses with their impacts and settings.

    Raises:
        ValueError: Where the pulses cannot be told apart.
    """
    if hits.mismatch is not None:
        raise ValueError(hits.mismatch)
    key = settings_id(session, hits.settings)
    _retire(session, hits.impacts)
    pulses = zip(hits.pulses, hits.impacts, strict=True)
    session.add_all(PulseRow(**pulse_values(pulse, impact, key)) for pulse, impact in pulses)


def _retire(session: Session, impacts: Sequence[int]) -> None:
    session.execute(
        update(PulseRow)
        .where(PulseRow.impact_id.in_(impacts), PulseRow.current)
        .values(current=False)
    )


def impacts_without_contact(session: Session, recording: int) -> list[int]:
    """Impacts of a recording of which none has a pulse, in the order of their rows; empty where
    some has one.

    Parameters:
        session: A session of the store.
        recording: The key of the recording.

    Returns:
        The keys of the impacts.
    """
    if impacts_of(session, recording):
        return []
    return list(
        session.scalars(
            select(Impact.id).where(Impact.recording_id == recording).order_by(Impact.id)
        )
    )


def has_figures(session: Session, impacts: Sequence[int]) -> bool:
    """Whether any of some impacts has figures of its accelerations.

    Parameters:
        session: A session of the store.
        impacts: The keys of the impacts.
    """
    query = select(ChannelFigures.id).where(ChannelFigures.impact_id.in_(impacts)).limit(1)
    return session.scalar(query) is not None


def acceleration_channels(session: Session, recording: int) -> tuple[Channel, ...]:
    """What is measured of each impact.

    Parameters:
        session: A session of the store.
        recording: The key of the recording.

    Returns:
        The acceleration channels of the recording, with all samples.

    Raises:
        SeriesError: As `force_channels`.
    """
    return _channels(session, recording, "acceleration")


def _channels(session: Session, recording: int, quantity: str) -> tuple[Channel, ...]:
    return tuple(
        read_channel(session, row)
        for row in list_channels(session, recording)
        if row.quantity == quantity
    )


def replace_figures(
    session: Session, recording: int, impacts: Sequence[int], figures: Sequence[ImpactFigures]
) -> int:
    """Store the figures of a recording's accelerations instead of those that were there.

    Parameters:
        session: A session that writes to the store.
        recording: The key of the recording.
        impacts: The keys of its impacts.
        figures: The figures of each impact by channel, in the order of `impacts`.

    Returns:
        The number of impacts that have figures.
    """
    session.execute(delete(ChannelFigures).where(ChannelFigures.impact_id.in_(impacts)))
    channels = {row.name: row.id for row in list_channels(session, recording)}
    session.add_all(ChannelFigures(**row) for row in figure_rows(figures, impacts, channels))
    return sum(bool(by_channel) for by_channel in figures)


#: Recordings under way at a time: a cluster of some dozen workers has enough to do.
_ON_A_CLUSTER = 64


@dataclass
class ReextractionReport:
    """What changed: pulses `added`, pulses of earlier versions put back in use, impacts whose
    accelerations were `measured` anew, recordings left as they were."""

    campaign: str
    added: int = 0
    reused: int = 0
    measured: int = 0
    skipped: list[dict[str, str]] = field(default_factory=list)

    def as_json(self) -> dict[str, object]:
        return asdict(self)


def reextract(
    store: Store,
    campaign: str,
    settings: ExtractionSettings,
    progress: Callable[[int, int, str], None] | None = None,
    executor: ExecutorConfig = HERE,
) -> ReextractionReport:
    """Cut every recording of a campaign again, one transaction each.

    A recording in which the new settings find another number of impacts is skipped and named: which
    pulse belongs to which impact would be a guess. So is one with damaged samples.

    Parameters:
        store: The open store that holds the campaign.
        campaign: The name of the campaign.
        settings: How pulses are cut out.
        progress: Called with (done, total, path) after each recording; by default progress is not
            reported.
        executor: Where pulses are cut, by default in this process; reading and storing stay here.

    Raises:
        LookupError: For an unknown campaign.
    """
    report = ReextractionReport(campaign)
    with store.reading() as session:
        query = select(Recording.id, Recording.path).where(
            Recording.campaign_id == get_campaign_id(session, campaign), Recording.status == STORED
        )
        recordings = [(key, path) for key, path in session.execute(query.order_by(Recording.id))]
    read = (_read(store, key, path, settings) for key, path in recordings)
    for done, (recording, pulses) in enumerate(
        run_all_tasks(executor, _reextracted, read, shared=(settings,), window=_window(executor)), 1
    ):
        _store_hits(store, recording, pulses, settings, report)
        if progress:
            progress(done, len(recordings), recording.path)
    report.skipped.sort(key=lambda item: item["recording"])  # whoever was first
    return report


def reextract_recording(
    store: Store, recording_key: int, settings: ExtractionSettings
) -> ReextractionReport:
    """`reextract` of one recording, with all its hits.

    Parameters:
        store: The open store that holds the recording.
        recording_key: The key of the recording.
        settings: How pulses are cut out.

    Raises:
        LookupError: As `preview_impacts`.
    """
    with store.reading() as session:
        campaign, path, _ = _recording(session, recording_key)
    report = ReextractionReport(campaign)
    recording = _read(store, recording_key, path, settings)
    _store_hits(store, recording, _reextracted(recording, settings), settings, report)
    return report


def preview_impacts(
    store: Store, recording_key: int, settings: ExtractionSettings
) -> HitReextraction:
    """What `reextract_recording` would store of a recording; nothing is.

    Parameters:
        store: The open store that holds the recording.
        recording_key: The key of the recording.
        settings: How pulses are cut out.

    Raises:
        LookupError: For a recording that there is not, was set aside, or in which no contact was
            found.
        SeriesError: As `force_channels`.
    """
    with store.reading() as session:
        _, _, impacts = _recording(session, recording_key)
        return reextract_stored_hits(session, recording_key, impacts, settings)


def _recording(session: Session, key: int) -> tuple[str, str, list[int]]:
    """Its campaign, its path and the impacts that can be cut."""
    columns = (Campaign.name, Recording.path, Recording.status, Recording.reason)
    row = session.execute(select(*columns).join(Campaign).where(Recording.id == key)).one_or_none()
    if row is None:
        raise LookupError(
            f"no recording {key} in the store; pyroshock show IMPACT names those of impacts"
        )
    campaign, path, status, reason = row
    if status != STORED:
        raise LookupError(
            f"recording {path!r} of campaign {campaign!r} was {status}, nothing to cut: {reason}"
        )
    impacts = impacts_of(session, key)
    if not impacts:
        raise LookupError(
            f"recording {path!r} of campaign {campaign!r} has no impact with a contact to cut"
        )
    return campaign, path, impacts


@dataclass(frozen=True)
class _RecordingRead:
    """A recording as it is cut, wherever that is. `channels` is None where nothing is to be cut;
    `damage` says why.

    `contacts`: its impacts are contacts of a force; else they are shocks of its accelerations.
    """

    key: int
    path: str
    impacts: tuple[int, ...]
    channels: tuple[Channel, ...] | None = None
    damage: str | None = None
    contacts: bool = True


def _window(executor: ExecutorConfig) -> int:
    """Recordings that are in memory at a time."""
    if executor.is_here:
        return 1
    return 4 * executor.jobs if executor.backend == LOCAL else _ON_A_CLUSTER


def _read(store: Store, key: int, path: str, settings: ExtractionSettings) -> _RecordingRead:
    with store.reading() as session:
        impacts = tuple(impacts_of(session, key))
        try:
            if not impacts:
                impacts = tuple(impacts_without_contact(session, key))
                channels = acceleration_channels(session, key) if impacts else ()
                return _RecordingRead(
                    key, path, impacts if channels else (), channels or None, contacts=False
                )
            accelerations = (
                () if has_figures(session, impacts) else acceleration_channels(session, key)
            )
            if not accelerations and len(stored_versions(session, impacts, settings)) == len(
                impacts
            ):
                return _RecordingRead(key, path, impacts)
            return _RecordingRead(
                key, path, impacts, (*force_channels(session, key), *accelerations)
            )
        except SeriesError as error:
            return _RecordingRead(key, path, impacts, damage=str(error))


def _reextracted(
    recording_read: _RecordingRead, settings: ExtractionSettings
) -> HitReextraction | None:
    return (
        None
        if recording_read.channels is None
        else reextract_recording_hits(recording_read.channels, recording_read.impacts, settings)
    )


def _store_hits(
    store: Store,
    recording_read: _RecordingRead,
    hits: HitReextraction | None,
    settings: ExtractionSettings,
    report: ReextractionReport,
) -> None:
    if hits is not None and not recording_read.contacts:
        _store_figures(store, recording_read, hits, report)
        return
    reason = recording_read.damage or (hits and hits.mismatch)
    if reason:
        report.skipped.append({"recording": recording_read.path, "reason": reason})
    elif recording_read.impacts:
        write = partial(
            _write_hits,
            recording=recording_read.key,
            impacts=recording_read.impacts,
            settings=settings,
            hits=hits,
        )
        added, reused, measured = store.write(write, idempotent=True)
        report.added += added
        report.reused += reused
        report.measured += measured


def _store_figures(
    store: Store, recording_read: _RecordingRead, hits: HitReextraction, report: ReextractionReport
) -> None:
    """The figures of a recording of accelerations alone."""
    if len(hits.figures) != len(recording_read.impacts):
        count = len(recording_read.impacts)
        reason = (
            f"not as many shocks found in its accelerations as the {count} impacts that are stored"
        )
        report.skipped.append({"recording": recording_read.path, "reason": reason})
        return
    write = partial(
        replace_figures,
        recording=recording_read.key,
        impacts=recording_read.impacts,
        figures=hits.figures,
    )
    report.measured += store.write(write, idempotent=True)


def _write_hits(
    session: Session,
    recording: int,
    impacts: Sequence[int],
    settings: ExtractionSettings,
    hits: HitReextraction | None,
) -> tuple[int, int, int]:
    """Pulses added, and put back in use; impacts whose accelerations were measured."""
    take_advisory_lock(session, f"recording {recording}")
    # Asked again in our turn: a second request for the same may have been faster.
    measured = 0
    if hits is not None and hits.figures and not has_figures(session, impacts):
        measured = replace_figures(session, recording, impacts, hits.figures)
    earlier = stored_versions(session, impacts, settings)
    if hits is None or len(earlier) == len(impacts):
        put_in_use(session, impacts, earlier)
        return 0, len(earlier), measured
    add_versions(session, hits)
    return len(hits.pulses), 0, measured
