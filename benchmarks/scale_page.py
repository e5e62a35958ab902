"""Measured figures of a large store: the lower part of docs/measurements/scale.md."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from .measuring import Spread, ratio

MARK = "<!-- below: written by `make bench-scale` -->"
SMALL, LARGE, TARGET = 100_000, 1_000_000, 10_000_000
#: A table or index that is smaller than this in the large store of the future is not told, bytes.
_SMALLEST = 50e6
#: A page that takes longer keeps a person waiting, seconds.
_SLOW_S = 1.0

Measured = dict[str, Any]


def page_of(measured: Measured) -> str:
    """Markdown: the stores, the questions with their growth, the plans, room, raw series, ingest."""
    parts = (_stores, _questions, _slowest, _room, _series, _ingest, _plans)
    return "\n\n".join("\n".join(part(measured)) for part in parts) + "\n"


def _table(head: Sequence[str], rows: Iterator[Sequence[str]]) -> list[str]:
    lines = [head, ["---"] * len(head), *rows]
    return ["| " + " | ".join(line) + " |" for line in lines]


def _count(number: float) -> str:
    return f"{number:,.0f}"


def _three(number: float) -> str:
    """Three digits, all of them where there are more before the point."""
    return f"{number:.3g}" if number < 999 else _count(number)


def _stores(measured: Measured) -> Iterator[str]:
    yield "## What was measured"
    yield ""
    small, large = measured["crowds"]
    yield (
        f"PostgreSQL {measured['server']} with its own settings, the client on the same machine "
        f"({measured['machine']}). Times are median (least to largest) of repeats in "
        "turn, all warm."
    )
    yield f"The large store has {_told(large)}; the small one {_told(small)}."
    campaigns = _count(TARGET // (large["impacts"] // large["campaigns"]))
    yield (
        f"What stands under {_count(TARGET)} is reckoned, of {campaigns} campaigns of the same size: room, and "
        "the times of what grows with the store (growth over 2), on the straight line through both; other times by "
        "their growth once more."
    )


def _told(crowd: Measured) -> str:
    return ", ".join(f"{_count(crowd[what])} {what}" for what in ("impacts", "campaigns", "recordings"))


def _questions(measured: Measured) -> Iterator[str]:
    yield "## Questions"
    yield ""
    small, large = (_count(crowd["impacts"]) for crowd in measured["crowds"])
    head = ("question", small, large, "growth", _count(TARGET), "statements")
    rows = (
        (
            question["name"],
            _times(Spread.of(question["small"])),
            _times(Spread.of(question["large"])),
            f"{_growth(question).text()} times",
            _duration(_carried_on(question)),
            str(question["plans"]["statements"]),
        )
        for question in measured["questions"]
    )
    yield from _table(head, rows)


def _growth(question: Measured) -> Spread:
    return ratio(question["large"], question["small"])


def _carried_on(question: Measured) -> float:
    """Seconds in the store to come: on the straight line where they grow with it, else by the same factor again."""
    small, large = (Spread.of(question[store]).median for store in ("small", "large"))
    if _grows(question):
        return large + (large - small) * (TARGET - LARGE) / (LARGE - SMALL)
    return large * max(1.0, _growth(question).median)


def _grows(question: Measured) -> bool:
    """A tree that is a page deeper does not double a time."""
    return _growth(question).median > 2


def _times(spread: Spread) -> str:
    return f"{_duration(spread.median)} ({_duration(spread.low)} to {_duration(spread.high)})"


def _duration(seconds: float) -> str:
    return f"{1e3 * seconds:.0f} ms" if seconds < 1 else f"{seconds:.2g} s"


def _slowest(measured: Measured) -> Iterator[str]:
    yield f"Over {_SLOW_S:g} s there:"
    yield ""
    slow = [(_carried_on(question), question) for question in measured["questions"]]
    for seconds, question in sorted(slow, key=lambda pair: -pair[0]):
        if seconds > _SLOW_S:
            grows = "grows with the store" if _grows(question) else "does not grow with it"
            yield f"- {question['name']}: {_duration(seconds)}; {grows}"


def _room(measured: Measured) -> Iterator[str]:
    yield "## Room"
    yield ""
    small, large = (crowd["impacts"] for crowd in measured["crowds"])
    head = ("table", "index", f"{_count(large)}: MB", "bytes an impact", f"{_count(TARGET)}: GB")
    # series of a few recordings only are in the stores: their own table tells what they take
    mine = [room for room in measured["rooms"] if room["table"] != "series_chunks"]
    shown = [room for room in mine if _at_target(room, small, large) >= _SMALLEST]
    total = sum(_at_target(room, small, large) for room in mine)
    rows = [_room_row(room, small, large) for room in shown]
    rows.append(
        [
            "all, without series",
            "",
            _megabytes(sum(r["large"] for r in mine)),
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
    yield "Raw series come on top:"
    yield ""
    head = ("recordings", "kHz", "samples an impact", "kB an impact", f"{_count(TARGET)}: TB")
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
    yield f"The table takes {100 * (share - 1):.2g} % more than the frames in it, its key included."


def _ingest(measured: Measured) -> Iterator[str]:
    ingest = measured["ingest"]
    yield "## Ingest"
    yield ""
    yield (
        f"Campaigns of {ingest['impacts']} impacts (ten in a MATLAB recording of 10 s with two channels at 51.2 kHz), "
        "pulses extracted, `--jobs 1` each:"
    )
    yield ""
    head = ("clients", "store", "impacts a second", f"hours for {_count(TARGET)}")
    rows = [
        ("1", "new", ingest["new"]),
        ("1", "large", ingest["full"]),
        (str(ingest["clients"]), "large", ingest["together"]),
    ]
    yield from _table(head, (_ingest_row(*row) for row in rows))
    yield ""
    against = ratio(ingest["full"], ingest["new"])
    yield f"The large store takes {against.text()} times as many a second as the new one."
    spent = Spread.of(ingest["full_processor_s"])
    yield f"Of the client's processor an impact costs {spent.text(' ms', 1e3)}."
    yield f"{_count(TARGET)} cost {TARGET * spent.median / 3600:.3g} hours of one processor, which several share."


def _ingest_row(clients: str, store: str, rates: list[float]) -> list[str]:
    rate = Spread.of(rates)
    return [clients, store, rate.text(), f"{TARGET / rate.median / 3600:.3g}"]


def _plans(measured: Measured) -> Iterator[str]:
    yield "## Plans"
    yield ""
    yield "Of each question's dearest statement in the large store, from the last step to the first; pages are of 8 kB."
    for question in measured["questions"]:
        plans = question["plans"]
        yield ""
        yield f"{question['name']} (1 of {plans['statements']}, {_three(plans['milliseconds'])} ms):"
        yield ""
        yield "```text"
        yield from plans["lines"]
        yield "```"
