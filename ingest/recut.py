"""The hits of one stored recording cut with other settings: looked at, or stored as the version in use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy import delete, func, select, update
from sqlalchemy.orm import Session

from ..schema.impacts import ChannelFigures, Impact
from ..schema.impacts import Pulse as PulseRow
from ..signals.channel import Channel
from .channel_figures import ImpactFigures, figure_rows, measure_channels
from .processing import hits_of
from .pulses import ExtractedPulse
from .rows import pulse_values, settings_id
from .settings import ExtractionSettings
from .stored import list_channels, read_channel


@dataclass(frozen=True)
class Cut:
    """What settings make of a recording: keys of its impacts in the order of their contacts, and the pulses found.

    Each impact has its pulse where `mismatch` is None; else it says why nobody can tell which belongs to which.
    `figures` are those of the acceleration channels for each impact, where they were read too.
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
        """The pulse of an impact; None where they cannot be told apart, or it is another recording's."""
        if self.mismatch is not None or impact not in self.impacts:
            return None
        return self.pulses[self.impacts.index(impact)]


def impacts_of(session: Session, recording: int) -> list[int]:
    """Impacts of a recording in the order of their contacts; those without a contact are left out."""
    query = (
        select(Impact.id)
        .join(PulseRow, PulseRow.impact_id == Impact.id)
        .where(Impact.recording_id == recording)
        .group_by(Impact.id)
        .order_by(func.min(PulseRow.start_s))
    )
    return list(session.scalars(query))


def cut(session: Session, recording: int, impacts: Sequence[int], settings: ExtractionSettings) -> Cut:
    """The recording's hits by these settings; nothing is stored. Raises as `force_channels`."""
    return cut_of(force_channels(session, recording), impacts, settings)


def force_channels(session: Session, recording: int) -> tuple[Channel, ...]:
    """What contacts are looked for in. Raises `schema.series.SeriesError` where samples are damaged."""
    return tuple(read_channel(session, row) for row in list_channels(session, recording) if row.quantity == "force")


def cut_of(channels: Sequence[Channel], impacts: Sequence[int], settings: ExtractionSettings) -> Cut:
    """`cut` of samples that were read; without the store."""
    hits = hits_of(list(channels), settings, len(impacts))
    figures = measure_channels(channels, hits, len(impacts), settings)
    return Cut(settings, tuple(impacts), hits.pulses, figures.impacts)


def versions(session: Session, impacts: Sequence[int], settings: ExtractionSettings) -> list[int]:
    """Pulses that were already cut with these settings."""
    query = select(PulseRow.id).join(PulseRow.settings).where(PulseRow.impact_id.in_(impacts))
    return list(session.scalars(query.where(PulseRow.settings.has(fingerprint=settings.fingerprint))))


def put_in_use(session: Session, impacts: Sequence[int], pulses: Sequence[int]) -> None:
    """Make these versions the ones in use."""
    _retire(session, impacts)
    session.execute(update(PulseRow).where(PulseRow.id.in_(pulses)).values(current=True))


def add_versions(session: Session, found: Cut) -> None:
    """Store the pulses as the versions in use. Raises `ValueError` where they cannot be told apart."""
    if found.mismatch is not None:
        raise ValueError(found.mismatch)
    key = settings_id(session, found.settings)
    _retire(session, found.impacts)
    pulses = zip(found.pulses, found.impacts, strict=True)
    session.add_all(PulseRow(**pulse_values(pulse, impact, key)) for pulse, impact in pulses)


def _retire(session: Session, impacts: Sequence[int]) -> None:
    session.execute(update(PulseRow).where(PulseRow.impact_id.in_(impacts), PulseRow.current).values(current=False))


def impacts_without_contact(session: Session, recording: int) -> list[int]:
    """Impacts of a recording of which none has a pulse, in the order of their rows; empty where some has one."""
    if impacts_of(session, recording):
        return []
    return list(session.scalars(select(Impact.id).where(Impact.recording_id == recording).order_by(Impact.id)))


def has_figures(session: Session, impacts: Sequence[int]) -> bool:
    """Whether any of these impacts has figures of its accelerations."""
    query = select(ChannelFigures.id).where(ChannelFigures.impact_id.in_(impacts)).limit(1)
    return session.scalar(query) is not None


def acceleration_channels(session: Session, recording: int) -> tuple[Channel, ...]:
    """What is measured of each impact. Raises as `force_channels`."""
    rows = list_channels(session, recording)
    return tuple(read_channel(session, row) for row in rows if row.quantity == "acceleration")


def replace_figures(session: Session, recording: int, impacts: Sequence[int], figures: Sequence[ImpactFigures]) -> int:
    """Store the figures of a recording's accelerations instead of those that were there; how many impacts have them."""
    session.execute(delete(ChannelFigures).where(ChannelFigures.impact_id.in_(impacts)))
    channels = {row.name: row.id for row in list_channels(session, recording)}
    session.add_all(ChannelFigures(**row) for row in figure_rows(figures, impacts, channels))
    return sum(bool(by_channel) for by_channel in figures)
