"""The force's course of many contacts, from nodes of which each contact has as many as it took."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from .bodies import Floats
from .marching import March
from .stepping import Index


@dataclass(frozen=True, eq=False)
class Course:
    """Force at the nodes of n contacts, one contact after the other; between them, cubics through force and rate.

    Each contact's first node is its begin, phase 0, its last one its end, phase 1.
    """

    first: Index  # (n + 1,): where the nodes of a contact begin
    phase: Floats  # (all nodes,)
    force: Floats
    rate: Floats  # of the force, for a phase

    @classmethod
    def of(cls, march: March) -> Self:
        """In the units of the march."""
        n = len(march.contact_time)
        counts = np.zeros(n, dtype=np.intp)
        for node in march.nodes:
            counts[node.index] += 1
        first = np.concatenate([[0], np.cumsum(counts)])
        time, force, rate = (np.empty(first[-1]) for _ in range(3))
        place = first[:-1].copy()
        for node in march.nodes:
            at = place[node.index]
            time[at], force[at], rate[at] = node.time, node.force, node.force_rate
            place[node.index] += 1
        last = np.repeat(march.contact_time, counts)
        return cls(first, np.minimum(time / last, 1.0), force, rate * last)

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Contacts of several courses in their order."""
        starts = np.cumsum([0, *(len(part.phase) for part in parts)])
        first = [part.first[:-1] + start for part, start in zip(parts, starts[:-1], strict=True)]
        together = (np.concatenate([getattr(part, name) for part in parts]) for name in ("phase", "force", "rate"))
        return cls(np.concatenate([*first, starts[-1:]]), *together)

    def at(self, phase: Floats) -> Floats:
        """Force (n, p) at phases (p,) of each contact."""
        rows = np.arange(len(self.first) - 1)[:, None]
        owner = np.repeat(rows[:, 0], np.diff(self.first))
        # Phases and rows in one key; a row has twice the room that its phases take, so that none meets the next.
        left = np.searchsorted(2.0 * owner + self.phase, (2.0 * rows + phase).ravel(), side="right") - 1
        left = np.minimum(left.reshape(len(rows), -1), self.first[1:, None] - 2)
        width = self.phase[left + 1] - self.phase[left]
        with np.errstate(invalid="ignore", divide="ignore"):
            share = np.where(width > 0, (phase - self.phase[left]) / width, 1.0)
        return np.asarray(np.maximum(self._cubic(left, share), 0.0))

    def _cubic(self, left: Index, share: Floats) -> Floats:
        """Of the interval after node `left`."""
        width = self.phase[left + 1] - self.phase[left]
        slopes = width * self.rate[left], width * self.rate[left + 1]
        return _hermite(share, self.force[left], self.force[left + 1], *slopes)


def peak_force(march: March) -> Floats:
    """Greatest force of each contact (n,), in the units of the march: of its nodes, and of the cubics between them."""
    n = len(march.contact_time)
    peak, time, force, rate = (np.zeros(n) for _ in range(4))
    for node in march.nodes:
        at = node.index
        peak[at] = np.maximum(peak[at], node.force)
        top = np.flatnonzero((rate[at] > 0) & (node.force_rate <= 0))
        if len(top):
            here = at[top]
            width = node.time[top] - time[here]
            slopes = width * rate[here], width * node.force_rate[top]
            peak[here] = np.maximum(peak[here], _summit(force[here], node.force[top], *slopes))
        time[at], force[at], rate[at] = node.time, node.force, node.force_rate
    return peak


def _summit(begin: Floats, end: Floats, rise: Floats, fall: Floats) -> Floats:
    """The greatest value of a cubic that rises at first, and falls or is level at last."""
    # The cubic's slope, rise + b t + c t^2; its root in the form that keeps its digits where c is small.
    step = end - begin
    b, c = 6 * step - 4 * rise - 2 * fall, 3 * (rise + fall - 2 * step)
    root = np.sqrt(np.maximum(b**2 - 4 * rise * c, 0.0))  # below nothing by rounding alone
    return _hermite(2 * rise / (root - b), begin, end, rise, fall)


def _hermite(share: Floats, begin: Floats, end: Floats, rise: Floats, fall: Floats) -> Floats:
    """A cubic by its values at 0 and 1, and by its slopes there."""
    back = 1 - share
    blend = begin * (1 + 2 * share) * back**2 + end * (3 - 2 * share) * share**2
    return np.asarray(blend + share * back * (rise * back - fall * share))
