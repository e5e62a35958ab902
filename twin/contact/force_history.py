"""The force's course of many contacts, from nodes of which each contact has as many as it took."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np

from ...array_types import Floats, Index
from .integrate_contact import March, Nodes


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
        nodes = march.nodes
        last = np.repeat(march.contact_time, np.diff(nodes.first))
        return cls(nodes.first, np.minimum(nodes.time / last, 1.0), nodes.force, nodes.force_rate * last)

    def at(self, phase: Floats) -> Floats:
        """Force (n, p) at phases (p,), or (n, p) of each contact."""
        from .kernel import at_phases

        wanted = np.array(np.atleast_2d(phase), dtype=np.float64, order="C")
        force = np.empty((len(self.first) - 1, wanted.shape[1]))
        at_phases(self.first, self.phase, self.force, self.rate, wanted, force)
        return force


def peak_force(nodes: Nodes) -> Floats:
    """Greatest force of each contact (n,): of its nodes, and of the cubics between them."""
    force, rate = nodes.force, nodes.force_rate
    peak = np.maximum.reduceat(force, nodes.first[:-1])
    falls = (rate[:-1] > 0) & (rate[1:] <= 0)
    falls[nodes.first[1:-1] - 1] = False  # from one contact's last node to the next one's first
    top = np.flatnonzero(falls)
    width = nodes.time[top + 1] - nodes.time[top]
    summits = _summit(force[top], force[top + 1], width * rate[top], width * rate[top + 1])
    np.maximum.at(peak, np.searchsorted(nodes.first, top, side="right") - 1, summits)
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
