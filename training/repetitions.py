"""Repetitions that predict each other: force and time of a group's pulses as polynomials of log velocity."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from ..dataset.table import PulseTable

#: What is regressed, (n x m), of pulses.
Targets = Callable[[PulseTable], Floats]


@dataclass(frozen=True, eq=False)
class Group:
    """Held-out pulses `rows` (h,) and what they are predicted from; the same rows where `alone`."""

    known: PulseTable
    asked: PulseTable
    rows: NDArray[np.intp]
    alone: bool


def groups_of(training: PulseTable, held_out: PulseTable, scope: str) -> list[Group]:
    """The held-out pulses by their label in `scope`, without those that have nothing to be predicted from."""
    groups = []
    known_labels, asked_labels = getattr(training, scope), getattr(held_out, scope)
    for label in np.unique(asked_labels):
        rows = np.flatnonzero(asked_labels == label)
        known_rows, asked_pulses = np.flatnonzero(known_labels == label), held_out.take(rows)
        if len(known_rows):
            groups.append(Group(training.take(known_rows), asked_pulses, rows, alone=False))
        elif len(rows) > 1:
            groups.append(Group(asked_pulses, asked_pulses, rows, alone=True))
    return groups


def velocity_of(pulses: PulseTable) -> Floats:
    """Impact velocities (n,). Raises `ValueError` for one that is not positive."""
    velocity = pulses.column("impact_velocity")
    if not (velocity > 0).all():
        row = int(np.flatnonzero(~(velocity > 0))[0])
        raise ValueError(f"pulse {pulses.key[row]} has impact_velocity = {velocity[row]:g} m/s: expected positive")
    return velocity


def force_targets(pulses: PulseTable) -> Floats:
    """Force / velocity, n x 20."""
    return pulses.force_n / velocity_of(pulses)[:, None]


def time_targets(pulses: PulseTable) -> Floats:
    """Logarithm of the contact time, n x 1."""
    targets: Floats = np.log(pulses.contact_time_s)[:, None]
    return targets


def _powers(pulses: PulseTable, about: float, degree: int) -> Floats:
    return np.vander(np.log(velocity_of(pulses)) - about, degree + 1)


def predicted(group: Group, degree: int, targets: Targets, corrected: bool) -> Floats:
    """Targets of the held-out pulses as the group predicts them."""
    actual = targets(group.asked)
    if group.alone:
        miss, share = _leave_one_out(group.known, degree, targets)
        return actual - miss * (np.sqrt(share)[:, None] if corrected else 1.0)
    about, degree = _terms(group.known, degree)
    smoother = _powers(group.asked, about, degree) @ np.linalg.pinv(_powers(group.known, about, degree))
    miss = actual - smoother @ targets(group.known)
    leverage = np.sum(smoother**2, axis=1)
    return actual - (miss / np.sqrt(1 + leverage)[:, None] if corrected else miss)


def _leave_one_out(pulses: PulseTable, degree: int, targets: Targets) -> tuple[Floats, Floats]:
    """What each pulse (n x m) differs by from the others' regression, and one minus its leverage (n,)."""
    about, degree = _terms(pulses, degree)
    powers, actual = _powers(pulses, about, degree), targets(pulses)
    smoother = powers @ np.linalg.pinv(powers)
    # One velocity apart from all others can own a line: its own error is then no number.
    share = np.maximum(1 - np.diag(smoother), 0.02)
    return (actual - smoother @ actual) / share[:, None], share


def _terms(pulses: PulseTable, degree: int) -> tuple[float, int]:
    """The mean of log velocity, and the degree, with two pulses at least for each coefficient."""
    return float(np.log(velocity_of(pulses)).mean()), max(0, min(degree, len(pulses) // 2 - 1))


def misfit(groups: list[Group], degree: int, targets: Targets) -> float:
    """Mean leave-one-out error over the pulses that are learned from; force relative to its range."""
    errors = []
    for known_pulses in (group.known for group in groups if len(group.known) > 1):
        miss, actual = _leave_one_out(known_pulses, degree, targets)[0], targets(known_pulses)
        size = np.ptp(actual, axis=1) if actual.shape[1] > 1 else 1.0
        errors.append(np.sqrt(np.mean(miss**2, axis=1)) / size)
    return float(np.mean(np.concatenate(errors))) if errors else float(degree)
