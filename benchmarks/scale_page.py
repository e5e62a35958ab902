"""Measured figures of a large store: the lower part of docs/measurements/scale.md."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from .measuring import Spread, ratio

MARK = "<!-- below: written by `make bench-scale` -->"
SMALL, LARGE, TARGET = 100_000, 1_000_000, 10_000_000
#: The page does not list a table or index that is smaller than this at 10,000,000 impacts, bytes.
_SMALLEST = 200e6
#: A user notices the delay of a page that takes longer, seconds.
_SLOW_S = 1.0

Measured = dict[str, Any]


def page_of(measured: Measured) -> str:
    """Markdown: the stores, the questions with their growth, disk space, raw series, ingest, the slowest plans."""
    parts = (_stores, _questions, _slowest, _room, _series, _ingest, _plans)
    return "\n\n".join("\n".join(part(measured)) for part in parts) + "\n"


def _table(head: Sequence[str], rows: Iterator[Sequence[str]]) -> list[str]:
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(line) + " |" for line in lines]


def _count(number: float) -> str:
    return f"{number:,.0f}"


def _three(number: float) -> str:
    """Three significant digits, or all digits before the point."""
    return f"{number:.3g}" if number < 999 else _count(number)


def _stores(measured: Measured) -> Iterator[str]:
    yield "## Set-up"
    yield ""
    small, large = measured["crowds"]
    yield (
        f"PostgreSQL {measured['server']} with its default settings runs on the same machine as the client "
        f"({measured['machine']}). Times are the median (smallest to largest) of repeated questions in alternation, "
        "with warm caches."
    )
    yield f"The large store has {_size_of(large)}; the small store has {_size_of(small)}."
    campaigns = _count(TARGET // (large["impacts"] // large["campaigns"]))
    yield (
        f"The columns of {_count(TARGET)} are calculated for {campaigns} campaigns of the same size. Disk space, and "
        "times that grow more than twofold, follow the straight line through both stores; the other times grow once "
        "more by their measured factor."
    )


def _size_of(crowd: Measured) -> str:
    return ", ".join(f"{_count(crowd[what])} {what}" for what in ("impacts", "campaigns", "recordings"))


def _questions(measured: Measured) -> Iterator[str]:
    yield "## Questions"
    yield ""
    small, large = (_count(crowd["impacts"]) for crowd in measured["crowds"])
    head = ("question", small, large, "growth factor", _count(TARGET), "statements")
    rows = (
        (
            question["name"],
            _times(Spread.of(question["small"])),
            _times(Spread.of(question["large"])),
            f"{_growth(question).median:.2f}",
            _duration(_carried_on(question)),
            str(question["plans"]["statements"]),
        )
        for question in measured["questions"]
    )
    yield from _table(head, rows)


def _growth(question: Measured) -> Spread:
    return ratio(question["large"], question["small"])


def _carried_on(question: Measured) -> float:
    """Seconds at 10,000,000 impacts: on the straight line if they grow with the store, else by the same factor."""
    small, large = (Spread.of(question[store]).median for store in ("small", "large"))
    if _grows(question):
        return large + (large - small) * (TARGET - LARGE) / (LARGE - SMALL)
    return large * max(1.0, _growth(question).median)


def _grows(question: Measured) -> bool:
    """A B-tree that is one page deeper does not double a time."""
    return _growth(question).median > 2


def _times(spread: Spread) -> str:
    """All three in the unit of the median: `28 ms (26 to 55)`."""
    if spread.median < 1:
        return f"{_duration(spread.median)} ({1e3 * spread.low:.0f} to {1e3 * spread.high:.0f})"
    return f"{_duration(spread.median)} ({spread.low:.2g} to {spread.high:.2g})"


def _duration(seconds: float) -> str:
    return f"{1e3 * seconds:.0f} ms" if seconds < 1 else f"{seconds:.2g} s"


def _slowest(measured: Measured) -> Iterator[str]:
    yield f"These questions take more than {_SLOW_S:g} s at {_count(TARGET)} impacts:"
    yield ""
    slow = [(_carried_on(question), question) for question in measured["questions"]]
    for seconds, question in sorted(slow, key=lambda pair: -pair[0]):
        if seconds > _SLOW_S:
            grows = "grows with the store" if _grows(question) else "does not grow with the store"
            yield f"- {question['name']}: {_duration(seconds)}; {grows}"


def _room(measured: Measured) -> Iterator[str]:
    yield "## Disk space"
    yield ""
    small, large = (crowd["impacts"] for crowd in measured["crowds"])
    head = ("table", "index", f"{_count(large)}: MB", "bytes per impact", f"{_count(TARGET)}: GB")
    # the stores hold series of a few recordings only: a table of their own shows their size
    tables = [room for room in measured["rooms"] if room["table"] != "series_chunks"]
    shown = [room for room in tables if _at_target(room, small, large) >= _SMALLEST]
    total = sum(_at_target(room, small, large) for room in tables)
    rows = [_room_row(room, small, large) for room in shown]
    rows.append(
        [
            "all tables and indexes, without series",
            "",
            _megabytes(sum(r["large"] for r in tables)),
            _count(total / TARGET),
            f"{total / 1e9:.3g}",
        ]
    )
    yield from _table(head, iter(rows))


def _room_row(room: Measured, small: int, large: int) -> list[str]:
    target = _at_target(room, small, large)
    index = f"`{room['index']}`" if room["index"] else ""
    per_impact = (room["large"] - room["small"]) / (large - small)
    return [f"`{room['table']}`", index, _megabytes(room["large"]), _count(per_impact), f"{target / 1e9:.3g}"]


def _megabytes(size: float) -> str:
    return _count(size / 1e6)


def _at_target(room: Measured, small: int, large: int) -> float:
    """Bytes on the straight line through both stores."""
    slope = float(room["large"] - room["small"]) / (large - small)
    return float(room["large"]) + slope * (TARGET - large)


def _series(measured: Measured) -> Iterator[str]:
    yield "Raw series need additional space:"
    yield ""
    head = ("recordings", "kHz", "samples per impact", "kB per impact", f"{_count(TARGET)}: TB")
    share = float(measured["frames_share"])
    rows = (
        (
            one["kind"],
            f"{one['rate_hz'] / 1e3:.3g}",
            _count(one["samples_per_impact"]),
            _three(share * one["bytes_per_impact"] / 1e3),
            f"{share * one['bytes_per_impact'] * TARGET / 1e12:.3g}",
        )
        for one in measured["series"]
    )
    yield from _table(head, rows)
    yield ""
    yield f"The table with its key takes {100 * (share - 1):.2g} % more than its frames."


def _ingest(measured: Measured) -> Iterator[str]:
    ingest = measured["ingest"]
    yield "## Ingest"
    yield ""
    yield (
        f"Each client ingests campaigns of {ingest['impacts']} impacts (ten in a MATLAB recording of 10 s with two "
        "channels at 51.2 kHz) with `--jobs 1` and extracts the pulses:"
    )
    yield ""
    head = ("clients", "store", "impacts per second", f"hours for {_count(TARGET)}")
    rows = [
        ("1", "new", ingest["new"]),
        ("1", "large", ingest["full"]),
        (str(ingest["clients"]), "large", ingest["together"]),
    ]
    yield from _table(head, (_ingest_row(*row) for row in rows))
    yield ""
    against, spent = ratio(ingest["full"], ingest["new"]), Spread.of(ingest["full_processor_s"])
    yield f"The rate of the large store is {against.text()} times that of the new one."
    hours = f"{TARGET * spent.median / 3600:.3g}"
    yield f"One impact takes {spent.text(' ms', 1e3)} of the client's processor time,"
    yield f"and {_count(TARGET)} impacts take {hours} hours, which several processors can share."


def _ingest_row(clients: str, store: str, rates: list[float]) -> list[str]:
    rate = Spread.of(rates)
    return [clients, store, rate.text(), f"{TARGET / rate.median / 3600:.3g}"]


def _plans(measured: Measured) -> Iterator[str]:
    yield "## Plans"
    yield ""
    yield (
        f"For each question over {_SLOW_S:g} s, this is the plan of its slowest statement in the large store, from the "
        "last step to the first. A page has 8 kB."
    )
    for question in measured["questions"]:
        if _carried_on(question) <= _SLOW_S:
            continue
        plans = question["plans"]
        yield ""
        yield f"{question['name']} (1 of {plans['statements']}, {_three(plans['milliseconds'])} ms):"
        yield ""
        yield "```text"
        yield from plans["lines"]
        yield "```"
