"""`python -m benchmarks.querying`: series and pulses of a campaign kept by us, h5py, sqlite3, pandas and QCoDeS.

The same recordings in memory, already cut into pulses, go into each of them and come back: stored recording by
recording; one series whole; a hundredth of it; the pulses of a factor's level. Each way is written as its user would,
and says what it guarantees. Everything lies in the system's cache; nobody waits for the disk. The limit is the same
bytes in plain files.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .apart import Apart, in_turn, interpreter_with, seconds_of
from .figures import Figure, missing
from .measuring import Spread, ratio
from .peers import ABSENT
from .querying_ours import Ours
from .querying_ways import Hdf5, Keeping, Parquet, PlainSqlite, Raw
from .recordings import write_campaign
from .stored_content import FACTOR, Content, content_of, written

THEME = "Series and pulses of {} recordings (10 s, two channels at 51.2 kHz, ten impacts each), kept and asked for"
RECORDINGS, STORES, READS, FULL_RECORDINGS = 24, 3, 15, 180
LEVEL, RUN = "steel", 2
PEERS = (Hdf5, PlainSqlite, Parquet)
QCODES = "QCoDeS"
#: What is asked, and its question in the first table.
STORE, WHOLE, WINDOW, PULSES = (
    "storing them",
    "one series whole",
    "a hundredth of a series",
    f"pulses with {FACTOR}={LEVEL}",
)
QUESTIONS = {
    STORE: "storing series and pulses",
    WHOLE: "reading a stored series",
    WINDOW: "reading a hundredth of a series",
    PULSES: "the pulses of a factor's level",
}


@dataclass(frozen=True)
class Asked:
    """A way in this process or another: a question gives seconds, or length and sum of each array that comes back."""

    seconds: Callable[[str], float]
    sums: Callable[[str], list[list[float]]]
    room: Callable[[], int]
    guarantees: str


def measure_querying(
    folder: Path, full: bool = False, recordings: int = RECORDINGS, stores: int = STORES, reads: int = READS
) -> Iterator[Figure]:
    """Every question of every way. Raises `ValueError` where one gives back something else than was stored."""
    recordings = FULL_RECORDINGS if full else recordings
    with tempfile.TemporaryDirectory(dir=folder) as place, ExitStack() as open_ones:
        source = write_campaign(Path(place) / "campaign", recordings, ".npz", np.random.default_rng(5))
        content = content_of(source)
        own = open_ones.enter_context(closing(Ours(Path(place) / "ours")))
        ways = {Ours.name: _here(own, content), Raw.name: _here(Raw(Path(place) / "raw"), content)}
        ways |= {kind.name: _here(kind(Path(place) / kind.name), content) for kind in PEERS}
        if python := interpreter_with("qcodes"):
            ways[QCODES] = _qcodes(open_ones, python, content, Path(place))
        yield from _figures(ways, content, recordings, stores, reads)


def _figures(ways: Mapping[str, Asked], content: Content, recordings: int, stores: int, reads: int) -> Iterator[Figure]:
    theme = THEME.format(recordings)
    for what, question in QUESTIONS.items():
        for way in ways.values():
            way.seconds(what)
        if what != STORE:
            _same(what, ways, content)
        repeats = stores if what == STORE else reads
        taken = in_turn({name: partial(way.seconds, what) for name, way in ways.items()}, repeats)
        limit = taken[Raw.name]
        for name, rival in _rivals(ways):
            if rival is None:
                yield missing(theme, f"{what}, beside {name}", ABSENT, question=question, rival=name)
                continue
            nature = "the same bytes in plain files"
            if what == STORE:
                nature += f"; ours: {ways[Ours.name].guarantees}; {name}: {rival.guarantees}"
            yield Figure(
                theme, f"{what}, beside {name}", _ms(taken[Ours.name]), _ms(taken[name]),
                ratio(taken[name], taken[Ours.name]), "at least", 1.0, nature, binding=False,
                near=ratio(taken[Ours.name], limit), question=question, rival=name,
            )  # fmt: skip
    yield from _rooms(theme, ways, content)


def _rooms(theme: str, ways: Mapping[str, Asked], content: Content) -> Iterator[Figure]:
    ours = ways[Ours.name].room()
    for name, way in _rivals(ways):
        if way is not None:
            room = way.room()
            yield Figure(
                theme, f"room on disk, beside {name}", f"{ours / 1e6:.3g} MB", f"{room / 1e6:.3g} MB",
                Spread.of([ours / room]), "at most", 1.0,
                f"in memory {content.bytes / 1e6:.3g} MB; noise does not pack",
                binding=False, of="room", question="room on disk", rival=name,
            )  # fmt: skip


def _rivals(ways: Mapping[str, Asked]) -> list[tuple[str, Asked | None]]:
    return [(name, ways.get(name)) for name in (*(kind.name for kind in PEERS), QCODES)]


def _window(content: Content) -> tuple[int, int]:
    size = next(iter(content.recorded[0].series.values())).size
    return size // 3, size // 3 + size // 100


def _here(way: Keeping, content: Content) -> Asked:
    asks: dict[str, Callable[[], Any]] = {
        STORE: partial(way.store, content),
        WHOLE: partial(way.whole, RUN),
        WINDOW: partial(way.window, RUN, *_window(content)),
        PULSES: partial(way.pulses, LEVEL),
    }

    def seconds(what: str) -> float:
        if what == STORE:
            way.empty()
        return seconds_of(asks[what])

    def sums(what: str) -> list[list[float]]:
        found = asks[what]()
        return _sums(found if isinstance(found, list) else [found])

    return Asked(seconds, sums, way.room, way.guarantees)


def _qcodes(open_ones: ExitStack, python: Path, content: Content, place: Path) -> Asked:
    files, folder = written(content, place / "content"), place / QCODES
    folder.mkdir()
    program = open_ones.enter_context(Apart("-m", "benchmarks.qcodes_peer", files, folder, python=python))
    of: dict[str, tuple[str, list[Any]]] = {
        STORE: ("store", []),
        WHOLE: ("whole", [RUN]),
        WINDOW: ("window", [RUN, *_window(content)]),
        PULSES: ("pulses", [FACTOR, LEVEL]),
    }

    def seconds(what: str) -> float:
        if what == STORE:
            program.ask(what="empty", of=[])
        name, arguments = of[what]
        return program.seconds(what=name, of=arguments)

    def sums(what: str) -> list[list[float]]:
        name, arguments = of[what]
        return list(program.ask(what=name, of=arguments)["sums"])

    return Asked(
        seconds, sums, lambda: int(program.ask(what="room", of=[])["bytes"]), "a transaction a value, no hashes"
    )


def _same(what: str, ways: Mapping[str, Asked], content: Content) -> None:
    """Every way gives back what was stored; the limit gives the pulses in one piece."""
    first, last = _window(content)
    force = content.recorded[RUN - 1].series["force"]
    stored: dict[str, list[Any]] = {WHOLE: [force], WINDOW: [force[first:last]], PULSES: content.pulses(LEVEL)}
    expected = _sums(stored[what])
    for name, way in ways.items():
        found = way.sums(what)
        alike = found == expected if name != Raw.name else np.allclose(np.sum(found, axis=0), np.sum(expected, axis=0))
        if not alike:
            raise ValueError(f"{name}, {what}: gave back other numbers than were stored")


def _sums(arrays: list[Any]) -> list[list[float]]:
    return [[len(x), float(np.sum(x, dtype=np.float64))] for x in arrays]


def _ms(seconds: list[float]) -> str:
    return Spread.of(seconds).text(" ms", 1e3)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        for figure in measure_querying(Path(folder)):
            sys.stdout.write(figure.row() + "\n")


if __name__ == "__main__":
    main()
