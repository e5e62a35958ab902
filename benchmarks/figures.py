"""A measured figure: what ours and the peer's took, their ratio with its spread, and what bounds it."""

from __future__ import annotations

from dataclasses import dataclass
from operator import ge, le
from typing import Literal

from .measuring import Spread

#: What a value is a ratio of, and what is said where ours is above the peer's. "growth" is ours with more over ours
#: with less, "bound" ours over a promise that has no peer: neither has anyone to lose to.
BEHIND = {"time": "slower", "memory": "more", "room": "more", "quality": "worse", "growth": "", "bound": ""}
Kind = Literal["time", "memory", "room", "quality", "growth", "bound"]


@dataclass(frozen=True)
class Figure:
    """`value` is measured and promised to be `sense` `limit` (None: told, not promised).

    `ours` and `peer` are what it is the ratio of: ours over the peer's where it is promised to be at most something,
    the peer's over ours where at least. No value: the peer is missing or gave nothing, and `peer` says why. `nature`
    names what bounds ours, and how near we come; `near` is ours over that bound where both were measured.
    """

    theme: str
    name: str
    ours: str
    peer: str
    value: Spread | None
    sense: Literal["at most", "at least"] = "at most"
    limit: float | None = None
    nature: str = ""
    #: Whether losing it fails `make bench`. What does not bind is an aim, shown all the same, met or missed.
    binding: bool = True
    near: Spread | None = None
    #: What it answers in the first table, which shows of each question the figure that is worst for us; "": details.
    question: str = ""
    of: Kind = "time"
    #: Which peer it is, in a word or two: the picture's label.
    rival: str = ""

    @property
    def holds(self) -> bool:
        if self.limit is None:
            return True
        return self.value is not None and {"at most": le, "at least": ge}[self.sense](self.value.median, self.limit)

    @property
    def over(self) -> Spread | None:
        """Ours over the peer's, whichever way it is promised: below 1 we are ahead."""
        return self.value.inverse() if self.value and self.sense == "at least" else self.value

    @property
    def behind(self) -> str:
        """In which way ours is behind its peer, as a word; "" where it is not, or has none."""
        return BEHIND[self.of] if self.over and self.over.median > 1 else ""

    @property
    def promise(self) -> str:
        if self.limit is None:
            return "—"
        most = self.limit if self.sense == "at most" else 1 / self.limit
        met, failed = ("holds", "**lost**") if self.binding else ("met", "**missed**")
        kept = met if self.holds else failed if self.value else "**not measured**"
        return f"{'' if self.binding else 'aim '}at most {most:.3g}: {kept}"

    @property
    def ratio(self) -> str:
        """As the tables show it, with a word where we lose."""
        if self.over is None:
            return "—"
        by_chance = ", within the spread" if self.over.low <= 1 else ""
        return self.over.text() + (f" **{self.behind}**{by_chance}" if self.behind else "")

    def row(self) -> str:
        near = self.near.text() if self.near else "—"
        return table_row(self.name, self.ours, self.peer, self.ratio, self.promise, self.nature or "—", near)


def missing(theme: str, name: str, why: str, *, ours: str = "—", question: str = "", rival: str = "") -> Figure:
    """The row of a peer that cannot be measured: not installed, out of memory, out of time."""
    return Figure(theme, name, ours, why, None, question=question, rival=rival)


def table_row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"
