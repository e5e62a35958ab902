"""Filtered listings of a store with a million impacts against one with ten thousand."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path

from pyroshock.schema.listings import Condition, iter_impacts
from pyroshock.schema.session import Store, Writer, open_store

from .crowded import RARE, campaign_name, fill
from .figures import Figure
from .measuring import Spread, interleaved, ratio
from .postgres import SERVER_VARIABLE, empty_databases

SMALL, LARGE, LIMIT = 10_000, 1_000_000, 2.0
THEME = "Filtered listings with {:,} impacts against {:,}"
QUESTION = "a filtered listing as the store grows"


@dataclass(frozen=True)
class Listing:
    """A question whose answer has as many rows in the small store as in the large one."""

    name: str
    campaign: str | None = None
    where: tuple[Condition, ...] = ()
    rows: int | None = None

    def keys(self, store: Store) -> list[int]:
        with store.reading() as session:
            return [row["id"] for row in islice(iter_impacts(session, self.campaign, self.where), self.rows)]


_STEEL = Condition("tip_material", "=", "steel")
_RARE = Condition(RARE[0], "=", RARE[1])
_LOW = Condition("hammer_speed", "=", "low")
_WIDE = Condition("tip_radius_m", "=", 0.03)
_FAST = Condition("impact_velocity_m_s", ">", 1.4)
LISTINGS = (
    Listing("one campaign and tip_material=steel", campaign_name(5), (_STEEL,)),
    Listing("one campaign and impact_velocity_m_s>1.4", campaign_name(3), (_FAST,)),
    Listing("hammer_speed=low, first 100 of a half", where=(_LOW,), rows=100),
    Listing("tip_material=steel and tip_radius_m=0.03, first 100", where=(_STEEL, _WIDE), rows=100),
    Listing("a level that ten impacts have", where=(_RARE,)),
    Listing("one campaign and that level", campaign_name(1), (_RARE,)),
)


def measure_listings(folder: Path, large: int = LARGE, repeats: int = 15) -> Iterator[Figure]:
    """Every listing on two SQLite stores in `folder`, made where they are not there yet."""
    yield from compare(filled(folder, SMALL), filled(folder, large), large, repeats)


def measure_listings_on_postgres(_folder: Path, large: int = LARGE, repeats: int = 15) -> Iterator[Figure]:
    """The same on the server that `TEST_DATABASE_URL` names."""
    with empty_databases(os.environ[SERVER_VARIABLE], 2) as urls:
        for url, impacts in zip(urls, (SMALL, large), strict=True):
            fill(url, impacts)
        yield from compare(urls[0], urls[1], large, repeats)


def filled(folder: Path, impacts: int) -> str:
    path = folder / f"impacts-{impacts}.db"
    if not path.exists():
        unfinished = folder / f"unfinished-{impacts}.db"
        for old in folder.glob(f"{unfinished.name}*"):
            old.unlink()
        fill(f"sqlite:///{unfinished}", impacts)
        unfinished.rename(path)
    return f"sqlite:///{path}"


def compare(small_url: str, large_url: str, impacts: int, repeats: int) -> Iterator[Figure]:
    """Every listing on both stores. Raises `ValueError` when one gives another number of rows."""
    writer = Writer("benchmark", "0")
    with open_store(small_url, writer) as small, open_store(large_url, writer) as large:
        kind = small.engine.dialect.name
        for listing in LISTINGS:
            keys = listing.keys(small), listing.keys(large)
            counts = len(keys[0]), len(keys[1])
            if counts[0] != counts[1] or not counts[0]:
                raise ValueError(f"{listing.name}: {counts[0]} and {counts[1]} rows; expected the same, and some")
            ways: dict[str, Callable[[], object]] = {
                "small": partial(listing.keys, small),
                "large": partial(listing.keys, large),
                "rows": partial(_rows_by_key, large, keys[1]),
            }
            taken = interleaved(ways, repeats)
            ours, peer = (Spread.of(taken[key]).text(" ms", 1e3) for key in ("large", "small"))
            plain = Spread.of(taken["rows"]).text(" ms", 1e3)
            yield Figure(
                THEME.format(impacts, SMALL), f"{kind}, {listing.name}", ours, peer,
                ratio(taken["large"], taken["small"]), "at most", LIMIT,
                f"the driver's own fetch of the {counts[0]} rows by their keys: {plain}",
                near=ratio(taken["large"], taken["rows"]), question=QUESTION, of="growth",
                rival=f"ours with {SMALL:,} impacts",
            )  # fmt: skip


def _rows_by_key(store: Store, keys: list[int]) -> int:
    """The same impacts and pulses as tuples, whose keys are known already: neither searched, nor named, nor judged."""
    listed = ",".join(map(str, keys))
    with store.reading() as session:
        statement = f"SELECT * FROM impacts AS i JOIN pulses AS p ON p.impact_id = i.id WHERE i.id IN ({listed})"  # noqa: S608  # keys of ours
        return len(session.connection().exec_driver_sql(statement).fetchall())
