"""What a store of 1,000 to 1,000,000 impacts takes: pages, selections, and room."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from pyroshock.schema.conditions import Condition
from pyroshock.schema.listings import iter_impacts, list_campaigns, list_impacts_page
from pyroshock.schema.session import Writer, open_store
from sqlalchemy.orm import Session

from .apart import in_turn, seconds_of
from .crowded import campaign_name
from .growth import Point
from .listings import filled

AXIS = "impacts"
SIZES = (1_000, 10_000, 100_000, 1_000_000)
REPEATS, PAGE = 5, 50
_STEEL = (Condition("tip_material", "=", "steel"),)


def _campaign(session: Session) -> int:
    return sum(1 for _ in iter_impacts(session, campaign_name(1)))


#: What is asked, and what bounds it.
QUESTIONS: dict[str, tuple[Callable[[Session], object], str]] = {
    "the first 50 impacts": (lambda s: list_impacts_page(s, None, (), None, PAGE), "50 rows at any size"),
    "the first 50 with tip_material=steel": (
        lambda s: list_impacts_page(s, None, _STEEL, None, PAGE),
        "50 rows at any size",
    ),
    "all impacts of a campaign": (_campaign, "its rows: 1,000 in the smallest store, 1,800 in the others"),
    "all campaigns with their counts": (list_campaigns, "an entry of an index for each impact"),
}


def store_points(folder: Path, sizes: tuple[int, ...] = SIZES) -> tuple[list[Point], dict[tuple[str, str], str]]:
    """Of SQLite stores in `folder`, made where they are not there yet; and what bounds each curve."""
    points: list[Point] = []
    for size in sizes:
        url = filled(folder, size)
        with open_store(url, Writer("benchmark", "0")) as store:

            def ask(question: Callable[[Session], object], store=store) -> object:  # type: ignore[no-untyped-def]
                with store.reading() as session:
                    return question(session)

            ways = {name: partial(seconds_of, partial(ask, question)) for name, (question, _) in QUESTIONS.items()}
            in_turn(ways, 1)
            taken = in_turn(ways, REPEATS)
        points += [Point(AXIS, name, size, tuple(values)) for name, values in taken.items()]
        file = Path(url.removeprefix("sqlite:///"))
        points.append(Point(AXIS, ROOM, size, (float(file.stat().st_size),), "bytes"))
    natures = {(AXIS, name): nature for name, (_, nature) in QUESTIONS.items()}
    each = points[-1].values[0] / sizes[-1]
    return points, natures | {(AXIS, ROOM): f"{each:.0f} bytes an impact, its pulse's figures and indexes included"}


ROOM = "room without series and curves"
