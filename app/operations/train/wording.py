"""Registered models in sentences: how large their errors are, on what, and which of two is better
by how much."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...common.number_format import NOTHING, format_number

#: What a version of each split has not seen in its training.
_UNSEEN = {
    "repetitions": "repetitions that it has not seen, of configurations that it has seen",
    "configurations": "configurations that it has not seen",
    "treatments": "treatments (configurations apart from the velocity) that it has not seen",
}
#: Metrics that are relative errors, by what they are called in a sentence; the cost is none.
ERRORS = {
    "force_nrmse": "force error",
    "peak_force_error": "error of the peak force",
    "contact_time_error": "error of the contact time",
    "impulse_error": "error of the impulse",
    "cost": "cost",
}


def unseen(split: str) -> str:
    """What the held-out pulses of a split are to the model, to follow "on"."""
    kind, _, value = split.partition("=")
    if value:
        return f"pulses of the {kind} {value}, none of which it has seen"
    return _UNSEEN.get(split, f"the held-out pulses of the split {split}")


def share(value: float | None, digits: int = 2) -> str:
    """A relative error in per cent: 0.04153 -> `4.2 %`."""
    return NOTHING if value is None else f"{_per_cent(value, digits)} %"


def _per_cent(value: float, digits: int = 2) -> str:
    """Whole per cent from 100 on, where two digits would round 214 to 210; with a true minus
    sign."""
    return format_number(100 * value, max(digits, 3) if abs(value) >= 1 else digits).replace(
        "-", "−"
    )


def bounded(ci90: Sequence[float] | None) -> list[float] | None:
    """An interval of a mean error, which is never negative: bootstrap and t intervals of few pulses
    may say so."""
    return None if ci90 is None else [max(0.0, ci90[0]), max(0.0, ci90[1])]


def share_range(ends: Sequence[float]) -> str:
    """`1.8 to 6.7 %` of the ends of an interval."""
    return f"{_per_cent(ends[0])} to {_per_cent(ends[1])} %"


def share_with_range(metric: Mapping[str, Any]) -> str:
    """`4.2 % (1.8 to 6.7 %)` of a metric of `version_row`; without an interval, the mean alone."""
    interval = bounded(metric["ci90"])
    if interval is None:
        return share(metric["mean"])
    return f"{share(metric['mean'])} ({share_range(interval)})"


def error_sentence(row: Mapping[str, Any]) -> str:
    """What a version's errors are, on what, and what the bench itself repeats to; `row` as
    `version_row` gives it."""
    metrics = row["metrics"]
    force = metrics["force_nrmse"]
    if force["mean"] is None:
        return f"{row['label']} has no force error on {unseen(row['split'])}."
    text = (
        f"{row['label']} predicts the force within {share_with_range(force)} and the contact time "
        f"within {share_with_range(metrics['contact_time_error'])} on {unseen(row['split'])}"
    )
    if row.get("not_usable"):
        return f"{text}. {row['not_usable']}."
    floors = [value for value in force["floor"].values() if value is not None]
    if floors:
        return f"{text}; repeated impacts of the bench differ by {share(floors[0])} in force."
    return f"{text}."


def lead_sentence(
    difference: Mapping[str, Any], means: Mapping[str, float], split: str = ""
) -> str:
    """Which of two versions is better, by how many per cent of the other's error.

    `difference` is a row of `side_by_side` (`a` minus `b`), `means` the mean errors of the metric
    by label, on the same pulses.
    """
    a, b, delta = difference["a"], difference["b"], difference["difference"]
    what = ERRORS.get(difference["metric"], difference["metric"].replace("_", " "))
    where = (
        f" on {unseen(split).replace(' it has', ' they have')}"
        if split
        else " on the pulses in common"
    )
    if delta == 0:
        return f"{a} and {b} have the same {what}{where}."
    better, worse, sign = (a, b, -1.0) if delta < 0 else (b, a, 1.0)
    base = means[worse]
    by = share(abs(delta) / base)
    if difference["ci90"]:
        ends = sorted(sign * end / base for end in difference["ci90"])
        by += f" ({share_range(ends)})"
    text = f"{better} is better than {worse} by {by} in the {what}{where}"
    p_value = difference["p_value"]
    if p_value is not None and p_value < 0.05:
        return f"{text}."
    least = difference.get("least_p_value")
    few = (
        f"; {difference['configurations']} configurations can give "
        f"{format_number(least, 2)} at the least"
        if least
        else ""
    )
    chance = "" if p_value is None else f" (p = {format_number(p_value, 2)}{few})"
    return f"{text}, but this may be chance{chance}."


#: What each model of `training.models.catalogue` is, for a person who chooses.
MODEL_SENTENCES = {
    "hunter": "The contact law of Hunter, a half sine; it learns nothing from the pulses.",
    "reed": "The contact law of Reed, a sine to the power of 1.5; it learns nothing "
    "from the pulses.",
    "hann": "The contact law with two halves of a raised cosine (von Hann); it "
    "learns nothing from the pulses.",
    "hertz": "The elastic contact law of Hertz; it learns nothing from the pulses.",
    "hunt-crossley": "The law of Hertz with the damping of Hunt and Crossley; it learns "
    "nothing from the pulses.",
    "linear": "Linear regression of force and contact time; the fastest one that learns.",
    "pls": "Partial least squares, for predictors that depend on each other.",
    "tree": "One regression tree; easy to read, coarse between the levels that were measured.",
    "ensemble": "The mean of 100 regression trees.",
    "kernel-ridge": "Least squares with a Gaussian kernel, for smooth dependencies.",
    "svr": "Support vector regression with a Gaussian kernel.",
    "svr-kernel": "Support vector regression on features that approximate a Gaussian kernel.",
    "coregional-gp": "One Gaussian process of all force points together, with intervals.",
    "gp": "Gaussian processes of the force points, one for each, with intervals.",
    "hybrid": "A pulse by von Hann's law and a correction that is learned from the "
    "pulses, with intervals.",
    "single-pass": "One regression of force and contact time together, with intervals.",
    "nn-narrow": "A neural network with one layer of 10 neurons.",
    "nn-medium": "A neural network with one layer of 25 neurons.",
    "nn-wide": "A neural network with one layer of 100 neurons.",
    "nn-bilayer": "A neural network with two layers of 10 neurons.",
    "nn-trilayer": "A neural network with three layers of 10 neurons.",
    "nn-ga": "A neural network whose layers a genetic search chooses; its training takes longest.",
}
