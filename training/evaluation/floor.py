"""The repeatability floor of a split, as the registry keeps it beside the models.

The repeatability floor: what a predictor reaches that knows the treatment exactly, from its
repetitions alone.

Told which group a pulse belongs to, and having measured that group, a predictor is left with what
repetitions of one setting do not share; no model can do better, but by chance, than to know each
group's law. Two groups are of interest:

- "configuration": all factors, the impact position included, which a model never sees.
- "treatment": what the predictors tell apart. What can be reached from them, with the positions'
  scatter in it.

Within a group force / velocity and log(contact time) are polynomials of log(velocity): a hammer is
swung by hand, and its velocity is known. One degree for all groups, of force and of time each, is
chosen by leave-one-out.

The plain floor pays for learning from few repetitions: with h the leverage, an error is sqrt(1 + h)
times the scatter of a repetition, 6 % more than it for the mean of eight. `corrected` divides by
that: errors of the noise alone, the floor of endless repetitions, if the polynomial is the truth.
The plain one is the default, as a predictor that exists reaches it; a model that learns many groups
together may come below it, but below the corrected one only by chance.

Repetitions that predict each other: force and time of a group's pulses as polynomials of log
velocity.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...dataset.table import PulseTable, split_of
from ..models.base import ContactPrediction
from ..models.training_task import rng_of
from .metrics import PulseErrors, pulse_errors
from .summary import Estimate, summary

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
    """The held-out pulses by their label in a scope, without those that have nothing to be
    predicted from.

    Parameters:
        training: The pulses that are known.
        held_out: The pulses that are predicted.
        scope: "configuration" or "treatment", the column of labels.
    """
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
    """Impact velocities (n,) of pulses, m/s.

    Parameters:
        pulses: Measured pulses, with the predictor `impact_velocity`.

    Raises:
        ValueError: For a velocity that is not positive.
    """
    velocity = pulses.column("impact_velocity")
    if not (velocity > 0).all():
        row = int(np.flatnonzero(~(velocity > 0))[0])
        raise ValueError(
            f"pulse {pulses.key[row]} has impact_velocity = {velocity[row]:g} "
            f"m/s: expected positive"
        )
    return velocity


def force_targets(pulses: PulseTable) -> Floats:
    """Force over velocity (n, 20), N s/m.

    Parameters:
        pulses: Measured pulses, with the predictor `impact_velocity`.
    """
    return pulses.force_n / velocity_of(pulses)[:, None]


def time_targets(pulses: PulseTable) -> Floats:
    """Logarithm of the contact time in s (n, 1).

    Parameters:
        pulses: Measured pulses.
    """
    return np.asarray(np.log(pulses.contact_time_s)[:, None])


def _powers(pulses: PulseTable, about: float, degree: int) -> Floats:
    return np.vander(np.log(velocity_of(pulses)) - about, degree + 1)


def predicted(group: Group, degree: int, targets: Targets, corrected: bool) -> Floats:
    """Targets (h, m) of the held-out pulses as their group predicts them.

    Parameters:
        group: The pulses that are known, and the h held-out ones.
        degree: The degree of the polynomial of log velocity. It is reduced where there are fewer
            than two pulses for each coefficient.
        targets: Gives the targets of pulses, such as `force_targets`.
        corrected: Whether the noise that the regression has from few repetitions is taken out.
    """
    actual = targets(group.asked)
    if group.alone:
        miss, share = _leave_one_out(group.known, degree, targets)
        return actual - miss * (np.sqrt(share)[:, None] if corrected else 1.0)
    about, degree = _terms(group.known, degree)
    smoother = _powers(group.asked, about, degree) @ np.linalg.pinv(
        _powers(group.known, about, degree)
    )
    miss = actual - smoother @ targets(group.known)
    leverage = np.sum(smoother**2, axis=1)
    return actual - (miss / np.sqrt(1 + leverage)[:, None] if corrected else miss)


def _leave_one_out(pulses: PulseTable, degree: int, targets: Targets) -> tuple[Floats, Floats]:
    """What each pulse (n x m) differs by from the others' regression, and one minus its leverage
    (n,)."""
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
    """Mean leave-one-out error over the pulses that are learned from.

    Parameters:
        groups: Held-out pulses by label; those count that have more than one known pulse.
        degree: The degree of the polynomials of log velocity.
        targets: Gives the targets of pulses, such as `force_targets`.

    Returns:
        The error. That of several targets (the force) is relative to their range in each pulse.
        Where no group counts it is the degree, so that the lowest one is preferred.
    """
    errors = []
    for known_pulses in (group.known for group in groups if len(group.known) > 1):
        miss, actual = _leave_one_out(known_pulses, degree, targets)[0], targets(known_pulses)
        size = np.ptp(actual, axis=1) if actual.shape[1] > 1 else 1.0
        errors.append(np.sqrt(np.mean(miss**2, axis=1)) / size)
    return float(np.mean(np.concatenate(errors))) if errors else float(degree)


Scope = Literal["configuration", "treatment"]

#: Of the polynomials that are tried.
DEGREES = (0, 1, 2)


@dataclass(frozen=True, eq=False)
class Floor:
    """`errors` are those of the held-out pulses `rows` (all but those without another repetition,
    `lonely` of them).

    `left_out` pulses had no training row in their group and were predicted from the group's other
    held-out pulses.
    """

    scope: Scope
    corrected: bool
    errors: PulseErrors
    rows: NDArray[np.intp]
    force_degree: int
    time_degree: int
    left_out: int
    lonely: int

    @property
    def note(self) -> str:
        """How it was found, in a sentence."""
        power = {0: "their mean", 1: "a line in log velocity", 2: "a parabola in log velocity"}
        parts = [f"each pulse from the other repetitions of its {self.scope}"]
        if self.left_out:
            parts.append(
                f"{self.left_out} of {len(self.rows)} leave-one-out among the held-out ones"
            )
        parts.append(f"force by {power[self.force_degree]}, time by {power[self.time_degree]}")
        if self.corrected:
            parts.append("the regression's own noise taken out")
        if self.lonely:
            parts.append(f"{self.lonely} pulses without another repetition have none")
        return "; ".join(parts)


def repeatability_floor(
    training: PulseTable,
    held_out: PulseTable,
    scope: Scope = "configuration",
    *,
    corrected: bool = False,
) -> Floor:
    """The floor of the held-out pulses, by the errors that models are judged with.

    Parameters:
        training: The pulses that are known.
        held_out: The pulses that are predicted from their repetitions.
        scope: What repetitions share: "configuration", all factors, which is the default, or
            "treatment", what the predictors tell apart.
        corrected: Whether the noise that the regression has from few repetitions is taken out of
            the errors; by default False.

    Raises:
        ValueError: Where no held-out pulse has another repetition, and for a velocity that is not
            positive.
    """
    groups = groups_of(training, held_out, scope)
    if not groups:
        raise ValueError(
            f"no held-out pulse shares its {scope} with another: repeat runs to know what repeats"
        )
    force_degree = min(DEGREES, key=lambda degree: misfit(groups, degree, force_targets))
    time_degree = min(DEGREES, key=lambda degree: misfit(groups, degree, time_targets))
    rows = np.concatenate([group.rows for group in groups])
    force = np.concatenate(
        [predicted(group, force_degree, force_targets, corrected) for group in groups]
    )
    time = np.concatenate(
        [predicted(group, time_degree, time_targets, corrected) for group in groups]
    )
    order = np.argsort(rows)
    pulses = held_out.take(rows[order])
    force_n = force[order] * velocity_of(pulses)[:, None]
    prediction = ContactPrediction(force_n, np.exp(time[order, 0]), None, None)
    return Floor(
        scope=scope,
        corrected=corrected,
        errors=pulse_errors(pulses, prediction),
        rows=rows[order],
        force_degree=force_degree,
        time_degree=time_degree,
        left_out=sum(len(group.rows) for group in groups if group.alone),
        lonely=len(held_out) - len(rows),
    )


SCOPES: tuple[Scope, ...] = ("configuration", "treatment")


def floor_text(table: PulseTable, dataset_hash: str, split_text: str, seed: int) -> str:
    """The repeatability floors of a split as JSON: by scope ("configuration", "treatment") the
    metrics and a note on how the floor was found. A scope without repetitions has its reason as
    note, and no metrics.

    Parameters:
        table: The pulses of the dataset.
        dataset_hash: The hash of the dataset, on which the draws of the intervals depend.
        split_text: The split, such as "configurations".
        seed: The seed of the split and of the draws.
    """
    split = split_of(table, split_text, seed)
    training, held_out = table.take(split.train), table.take(split.test)
    floors_by_scope: dict[str, Any] = {}
    for scope in SCOPES:
        try:
            floor = repeatability_floor(training, held_out, scope)
        except ValueError as error:
            floors_by_scope[scope] = {"metrics": {}, "note": str(error)}
            continue
        rng = rng_of("bootstrap", dataset_hash, split_text, seed)
        estimates = summary(floor.errors, held_out.configuration[floor.rows], rng)
        floors_by_scope[scope] = {
            "metrics": {name: asdict(estimate) for name, estimate in estimates.items()},
            "note": floor.note,
        }
    return json.dumps(floors_by_scope)


def floor_metrics(text: str, scope: str) -> Mapping[str, Estimate]:
    """The metrics of one scope by name.

    Parameters:
        text: JSON as `floor_text` gives it.
        scope: "configuration" or "treatment".
    """
    return {
        name: Estimate(**estimate) for name, estimate in json.loads(text)[scope]["metrics"].items()
    }
