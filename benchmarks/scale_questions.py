"""What a laboratory asks of its store, from the first page to an export: each question once, by name."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pyroshock.app.impacts.export import export_table
from pyroshock.app.impacts.impact import impact_page
from pyroshock.app.impacts.overlays import pulse_overlay
from pyroshock.app.impacts.signals import channel_window
from pyroshock.app.ingest.campaign_overview import campaign_overview, list_campaigns_page
from pyroshock.dataset.selection import select_pulses
from pyroshock.schema.listings import Condition, iter_impacts, list_campaigns, list_impacts_page
from pyroshock.schema.recordings import RecordedChannel
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from .crowded import HITS_PER_RECORDING, RARE, Crowd, campaign_name

PAGE = 50


@dataclass(frozen=True)
class Question:
    """`ask` gets a session of a store that was filled with the crowd."""

    name: str
    ask: Callable[[Session, Crowd], object]


def _page(*where: Condition, campaign: bool = False) -> Callable[[Session, Crowd], object]:
    """The first page of what meets the conditions, of all impacts or of a campaign."""
    return lambda session, crowd: list_impacts_page(session, _middle(crowd) if campaign else None, where, None, PAGE)


def _middle(crowd: Crowd) -> str:
    return campaign_name(crowd.campaigns // 2)


def _whole_campaign(session: Session, crowd: Crowd) -> int:
    return sum(1 for _ in iter_impacts(session, _middle(crowd)))


def _last_page(session: Session, crowd: Crowd) -> object:
    return list_impacts_page(session, None, (), crowd.impacts - PAGE, PAGE)


def _impact_with_slice(session: Session, crowd: Crowd) -> object:
    """The page of an impact whose recording has its series, and a tenth of a second of a channel."""
    recording = crowd.recordings // 2 // crowd.series_every * crowd.series_every
    shown = impact_page(session, recording * HITS_PER_RECORDING)
    first = select(func.min(RecordedChannel.id)).where(RecordedChannel.recording_id == recording)
    return shown, channel_window(session, session.scalars(first).one(), 0.2, 0.3)


def _dataset(session: Session, crowd: Crowd) -> object:
    return select_pulses(session, [_middle(crowd)], None, "reject", None)


def _export(session: Session, crowd: Crowd) -> object:
    with tempfile.TemporaryDirectory() as folder:
        return export_table(session, "pulses", Path(folder) / "pulses.parquet", _middle(crowd))


_STEEL = Condition("tip_material", "=", "steel")
_NOT_STEEL = Condition("tip_material", "!=", "steel")
_LOW = Condition("hammer_speed", "=", "low")
_RARE = Condition(RARE[0], "=", RARE[1])
_STRONG = Condition("peak_force_n", ">", 2990.0)
_NONE = Condition("peak_force_n", ">", 1e9)

QUESTIONS = (
    Question("the newest ten campaigns with their counts", lambda s, _: list_campaigns_page(s, limit=10)),
    Question("all campaigns with their counts", lambda s, _: list_campaigns(s)),
    Question("a campaign's page", lambda s, crowd: campaign_overview(s, _middle(crowd))),
    Question("all impacts of a campaign", _whole_campaign),
    Question("a campaign's impacts, first page", _page(campaign=True)),
    Question("all impacts, first page", _page()),
    Question("all impacts, last page", _last_page),
    Question("tip_material=steel, first page", _page(_STEEL)),
    Question("tip_material!=steel, first page", _page(_NOT_STEEL)),
    Question("tip_material=steel and hammer_speed=low, first page", _page(_STEEL, _LOW)),
    Question("the same in one campaign", _page(_STEEL, _LOW, campaign=True)),
    Question("a level that ten impacts have", _page(_RARE)),
    Question("peak_force_n>2990 (one in a hundred), first page", _page(_STRONG)),
    Question("peak_force_n>1e9 (no match)", _page(_NONE)),
    Question("the same in one campaign", _page(_NONE, campaign=True)),
    Question("an impact's page, and 0.1 s of a channel", _impact_with_slice),
    Question("overlaid pulses of a campaign", lambda s, c: pulse_overlay(s, _middle(c), (), "tip_material")),
    Question("overlaid pulses of all impacts", lambda s, _: pulse_overlay(s, None, (), "tip_material")),
    Question("pulses for a dataset from one campaign", _dataset),
    Question("a campaign's pulses as Parquet", _export),
)
