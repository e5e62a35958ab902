"""Registered models in sentences: whether they are usable, how large their errors are, whether
their bands hold, and which of two is better.

Sentences and tables are made of plain data: of a row of `figures.version_row`, and of what
`figures.side_by_side` gives, so that commands, pages and reports say the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from ....training.evaluation.gate import LARGEST_ERROR, LIMIT_WORDS, find_unusable
from ...common.number_format import NOTHING, error_percent, format_number, percent
from ...common.quantities import heading
from ..operation import ResultTable
from ..sentence import (
    BETTER,
    EQUAL,
    HOLDS,
    NOT_TOLD_APART,
    REACHES,
    TOO_NARROW,
    TOO_WIDE,
    WITHIN,
    Number,
    Sentence,
    first_allowed,
    sentence,
)

#: What a version of each split has not seen in its training.
_UNSEEN = {
    "repetitions": "repetitions that it has not seen, of configurations that it has seen",
    "configurations": "configurations that it has not seen",
    "treatments": "treatments (configurations apart from the velocity) that it has not seen",
}
#: Splits whose held-out pulses are of configurations that a model has not seen: what a promotion
#: rests on.
UNSEEN_SPLITS = ("configurations", "treatments")
#: Metrics by what they are called in a sentence, where these are not the words of their heading.
ERRORS = {
    "force_nrmse": "force error",
    "peak_force_error": "error of the peak force",
    "contact_time_error": "error of the contact time",
    "impulse_error": "error of the impulse",
}
#: Coverage of a version -> what its bands hold.
COVERED = {"force_covered": "force points", "time_covered": "contact times"}
#: What a band promises.
_NOMINAL = 0.9


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


def is_relative(metric: str) -> bool:
    """Whether the errors of a metric are shares of what was measured."""
    return metric.endswith("_error") or metric == "force_nrmse"


def metric_number(metric: str, value: float) -> Number:
    """A mean error of a metric: relative ones in per cent."""
    return Number(metric, value, "error" if is_relative(metric) else "quantity")


def difference_number(metric: str, value: float) -> Number:
    """A difference of two mean errors: of relative ones in percentage points, since "better by 96
    %" would be read as a share of the other error, which no difference exceeds."""
    return Number(metric, value, "points" if is_relative(metric) else "quantity")


def metric_cell(metric: str, value: float | None) -> str:
    """A mean error as a cell of a table, with its unit; a dash for none."""
    return NOTHING if value is None else str(metric_number(metric, value))


def difference_cell(metric: str, value: float | None) -> str:
    """A difference of two mean errors as a cell of a table; a dash for none."""
    return NOTHING if value is None else str(difference_number(metric, value))


# --- one version


def version_sentences(row: Mapping[str, Any]) -> list[Sentence]:
    """Whether a version is usable, how large its errors are, and whether its bands hold."""
    return [_error_sentence(row), *_band_sentences(row)]


def is_warned_of(row: Mapping[str, Any]) -> bool:
    """Whether a person who takes a version must be warned: it is not usable, or its bands are too
    narrow."""
    return any(claim.rule in (REACHES, TOO_NARROW) for claim in version_sentences(row))


def exceeded_limit(row: Mapping[str, Any]) -> dict[str, Any] | None:
    """The `error`, the `limit` and the `rule` by which a version is not usable; None where it
    is."""
    force = row["metrics"]["force_nrmse"]
    if force["mean"] is None:
        return None
    reason = find_unusable(
        row["label"],
        row["split"],
        force["mean"],
        (force["ci90"] or [None])[0],
        force["floor"].get("configuration"),
        row.get("force_nrmse_of_mean"),
    )
    if reason is None:
        return None
    return {"error": reason.error, "limit": reason.limit, "rule": reason.rule}


def _unusable_sentence(label: str, split: str, exceeded: Mapping[str, Any]) -> Sentence:
    """Why a version is no prediction, of `exceeded_limit`."""
    error, limit = exceeded["error"], exceeded["limit"]
    return sentence(
        "{label} is not usable: its force error on the split {split} is {error}, above {limit}, "
        "{words}.",
        REACHES,
        {"value": error, "limit": limit},
        label=label,
        split=split,
        error=metric_number("force_nrmse", error),
        limit=metric_number("force_nrmse", limit),
        words=LIMIT_WORDS[exceeded["rule"]],
    )


def _error_sentence(row: Mapping[str, Any]) -> Sentence:
    metrics, label, where = row["metrics"], str(row["label"]), unseen(row["split"])
    force = metrics["force_nrmse"]
    if force["mean"] is None:
        return sentence("{label} has no force error on {where}.", label=label, where=where)
    if exceeded := exceeded_limit(row):
        return _unusable_sentence(label, row["split"], exceeded)
    template, shown = "{label} predicts", {"label": label, "where": where}
    numbers: dict[str, Number] = {}
    for metric, noun in (("force_nrmse", "the force"), ("contact_time_error", "the contact time")):
        figure = metrics[metric]
        if figure["mean"] is None:
            continue
        template += f"{' and' if numbers else ''} {noun} within {{{metric}}}"
        numbers[metric] = metric_number(metric, figure["mean"])
        if ends := bounded(figure["ci90"]):
            template += f" ({{{metric}_low}} to {{{metric}_high}})"
            numbers[f"{metric}_low"] = metric_number(metric, ends[0])
            numbers[f"{metric}_high"] = metric_number(metric, ends[1])
    template += " on {where}"
    floor = next((value for value in force["floor"].values() if value is not None), None)
    if floor is not None:
        template += "; repeated impacts of the bench differ by {floor} in force"
        numbers["floor"] = metric_number("force_nrmse", floor)
    of_mean = row.get("force_nrmse_of_mean")
    if of_mean is not None and of_mean <= force["mean"]:
        template += "; the mean of the pulses that it learned from errs no more ({of_mean})"
        numbers["of_mean"] = metric_number("force_nrmse", of_mean)
    evidence = {"value": force["mean"], "limit": LARGEST_ERROR}
    return sentence(f"{template}.", WITHIN, evidence, **shown, **numbers)


def _band_sentences(row: Mapping[str, Any]) -> Iterator[Sentence]:
    shares = {name: held for name, held in (row["coverage90"] or {}).items() if held is not None}
    if not shares:
        yield Sentence("It gives no bands.")
    for name, value in shares.items():
        interval = (row.get("coverage90_ci90") or {}).get(name)
        held, noun = Number(name, value, "share"), COVERED[name]
        if interval is None:
            yield sentence("Its 90 % bands hold {held} of the {noun}.", held=held, noun=noun)
            continue
        words = "they hold {held} of them ({low} to {high})"
        yield first_allowed(
            {"interval": tuple(interval), "level": _NOMINAL},
            (TOO_NARROW, f"Its 90 % bands are too narrow for the {{noun}}: {words}."),
            (TOO_WIDE, f"Its 90 % bands are wider than necessary for the {{noun}}: {words}."),
            (
                HOLDS,
                "Its 90 % bands hold {held} of the {noun} ({low} to {high}), which agrees with "
                "what they promise.",
            ),
            held=held,
            noun=noun,
            low=Number(name, interval[0], "share"),
            high=Number(name, interval[1], "share"),
        )


def version_tables(row: Mapping[str, Any]) -> list[ResultTable]:
    """The figures of a version, and the limits of a usable one."""
    rows: list[dict[str, Any]] = []
    has_thesis = any(metric.get("thesis") is not None for metric in row["metrics"].values())
    for name, metric in row["metrics"].items():
        low, high = bounded(metric["ci90"]) or (None, None)
        values = {"mean": metric["mean"], "from": low, "to": high}
        values |= {f"repeatability by {scope}": floor for scope, floor in metric["floor"].items()}
        values |= {"thesis": metric.get("thesis")} if has_thesis else {}
        cells = {column: metric_cell(name, value) for column, value in values.items()}
        rows.append({"figure": heading(name).partition(" (")[0], **cells})
    for name, value in (row["coverage90"] or {}).items():
        ends = (row.get("coverage90_ci90") or {}).get(name) or [None, None]
        cells = {
            column: NOTHING if part is None else percent(part)
            for column, part in zip(("mean", "from", "to"), (value, *ends), strict=True)
        }
        rows.append({"figure": f"{COVERED[name]} in the 90 % band", **cells})
    limits = {"force error of the mean pulse": row.get("force_nrmse_of_mean")}
    limits["limit of a usable force error"] = (exceeded_limit(row) or {}).get("limit")
    rows += [
        {"figure": words, "mean": error_percent(limit)}
        for words, limit in limits.items()
        if limit is not None
    ]
    return [ResultTable("Means over the held-out pulses, with 90 % intervals", rows)]


# --- versions beside each other


def metric_words(metric: str) -> str:
    """What a sentence calls a metric."""
    return ERRORS.get(metric) or heading(metric).partition(" (")[0]


def difference_sentence(
    difference: Mapping[str, Any], means: Mapping[str, float], split: str = ""
) -> Sentence:
    """Which of two versions is better, or that they cannot be told apart.

    `difference` is a row of `side_by_side` (`a` minus `b`), `means` the mean errors of the metric
    by label, on the same pulses.
    """
    lead = _Lead(difference)
    errors = "{error} against {other}; the difference of the errors is {difference}"
    errors += " (90 % interval {low} to {high})" if lead.ends else ""
    few = "; {configurations} configurations give {least} at the least" if lead.least else ""
    chance = f"; p is {{p_value}}{few}" if math.isfinite(lead.p_value) else ""
    where = unseen(split).replace(" it has", " they have") if split else "the pulses in common"
    return first_allowed(
        {"difference": -lead.size, "p_value": lead.p_value},
        (EQUAL, "{better} and {worse} have the same {metric} on {where}: {error}."),
        (BETTER, f"{{better}} is better than {{worse}} in the {{metric}} on {{where}}: {errors}; "
                 "p is {p_value}."),
        (NOT_TOLD_APART, f"{{better}} and {{worse}} cannot be told apart in the {{metric}} on "
                         f"{{where}}: {errors}, which may be chance{chance}."),
        metric=metric_words(lead.metric),
        where=where,
        error=metric_number(lead.metric, means[lead.better]),
        other=metric_number(lead.metric, means[lead.worse]),
        **lead.shown(),
    )  # fmt: skip


class _Lead:
    """A difference of two versions as the lead of the one with the smaller error."""

    def __init__(self, difference: Mapping[str, Any]) -> None:
        delta, p_value = float(difference["difference"]), difference["p_value"]
        a, b = str(difference["a"]), str(difference["b"])
        self.better, self.worse = (a, b) if delta <= 0 else (b, a)
        self.metric, self.size = str(difference["metric"]), abs(delta)
        sign = -1.0 if delta <= 0 else 1.0
        self.ends = sorted(sign * end + 0.0 for end in difference["ci90"] or ())
        self.p_value = math.nan if p_value is None else float(p_value)
        self.least: float | None = difference.get("least_p_value")
        self.configurations = int(difference.get("configurations") or 0)
        self.group = " and ".join(
            f"{name.replace('_', ' ')} is {level}"
            for name, level in (difference.get("group") or {}).items()
        )

    def shown(self) -> dict[str, Any]:
        """Words and numbers of a sentence."""
        shown: dict[str, Any] = {"better": self.better, "worse": self.worse}
        shown["difference"] = difference_number(self.metric, self.size)
        if math.isfinite(self.p_value):
            shown["p_value"] = Number("p_value", self.p_value)
        if self.ends:
            shown |= {
                name: difference_number(self.metric, end)
                for name, end in zip(("low", "high"), self.ends, strict=True)
            }
        if self.least:
            shown["least"] = Number("least_p_value", self.least)
            shown["configurations"] = Number("configurations", self.configurations, "count")
        return shown

    def row(self) -> dict[str, Any]:
        """As a row of a table."""
        low, high = self.ends or (None, None)
        own = {"where": self.group} if self.group else {}
        least = {"least_p_value": self.least, "configurations": self.configurations or None}
        return {
            "smaller error": self.better,
            "larger error": self.worse,
            "metric": metric_words(self.metric),
            **own,
            "difference": difference_cell(self.metric, self.size),
            "from": difference_cell(self.metric, low),
            "to": difference_cell(self.metric, high),
            "p_value": self.p_value if math.isfinite(self.p_value) else None,
            **({} if own else least),
        }


def comparison_sentences(
    comparison: Mapping[str, Any], metrics: Sequence[str]
) -> Iterator[Sentence]:
    """On how many pulses versions were compared, which are not usable, which is better in each
    metric and where, and what follows for the one in use; `comparison` as `side_by_side` gives
    it."""
    models, split = comparison["models"], common_split(comparison)
    yield sentence(
        "{pulses} held-out pulses on which none of the models was trained.",
        pulses=Number("pulses", comparison["pulses"], "count"),
    )
    for model in models:
        if model["exceeded_limit"]:
            yield _unusable_sentence(model["label"], model["split"], model["exceeded_limit"])
    for difference in comparison["differences"]:
        if difference["metric"] in metrics:
            means = {model["label"]: model["metrics"][difference["metric"]] for model in models}
            yield difference_sentence(difference, means, split)
            yield from _group_sentences(difference["where"])
    yield from _advice(comparison, split)


def _group_sentences(differences: Sequence[Mapping[str, Any]]) -> Iterator[Sentence]:
    """Where each of two versions is better, of groups that differ beyond chance."""
    leads = [_Lead(row) for row in differences]
    for better in dict.fromkeys(lead.better for lead in leads):
        own = [lead for lead in leads if lead.better == better]
        places = ", ".join(f"{lead.group} (by {{lead_{i}}})" for i, lead in enumerate(own))
        yield sentence(
            f"{{better}} is better than {{worse}} in the {{metric}} where {places}.",
            BETTER,
            {
                "difference": max(-lead.size for lead in own),
                "p_value": max(lead.p_value for lead in own),
            },
            better=better,
            worse=own[0].worse,
            metric=metric_words(own[0].metric),
            **{
                f"lead_{i}": difference_number(lead.metric, lead.size) for i, lead in enumerate(own)
            },
        )


def promotable(comparison: Mapping[str, Any], metric: str) -> str | None:
    """The version that is better than the one in use (else than all others) on unseen
    configurations, beyond chance, in a metric; None where there is none, as on repetitions."""
    first, split = comparison["models"][0], common_split(comparison)
    if split not in UNSEEN_SPLITS or first["exceeded_limit"] or first.get("champion_of"):
        return None
    label = str(first["label"])
    in_use = {model["label"] for model in comparison["models"] if model.get("champion_of")}
    against = [
        row
        for row in comparison["differences"]
        if row["metric"] == metric
        and label in (row["a"], row["b"])
        and (not in_use or {row["a"], row["b"]} & in_use)
    ]
    leads = [_Lead(row) for row in against]
    is_better = all(
        lead.better == label and BETTER.allows(difference=-lead.size, p_value=lead.p_value)
        for lead in leads
    )
    return label if leads and is_better else None


def _advice(comparison: Mapping[str, Any], split: str) -> Iterator[Sentence]:
    """What follows for the version in use."""
    first = comparison["models"][0]
    if split not in UNSEEN_SPLITS:
        yield Sentence(
            "These held-out pulses do not decide which model is put in use: not all of them are "
            "of configurations that the models have not seen."
        )
    elif comparison["promotable"] is not None:
        yield sentence("{label} can be put in use.", label=comparison["promotable"])
    elif not first["exceeded_limit"] and not first.get("champion_of"):
        yield Sentence(
            "None of them is shown to be better than the model in use, or than all others: "
            "measure further configurations, and build a dataset with them."
        )


def common_split(comparison: Mapping[str, Any]) -> str:
    """On which versions were judged; empty where it is not the same for all."""
    splits = {model["split"] for model in comparison["models"]}
    return splits.pop() if len(splits) == 1 else ""


def comparison_tables(comparison: Mapping[str, Any], metrics: Sequence[str]) -> list[ResultTable]:
    """The mean errors, the differences of each pair, and those of groups beyond chance."""
    models, differences = comparison["models"], comparison["differences"]
    exceeded = any(model["exceeded_limit"] for model in models)
    rows: list[dict[str, Any]] = []
    for model in models:
        cells = {
            metric_words(metric): metric_cell(metric, model["metrics"][metric])
            for metric in metrics
        }
        row = {"model": model["label"], "split": model["split"], "pulses": comparison["pulses"]}
        if exceeded:
            limit = model["exceeded_limit"] or {}
            cells["force error on its split"] = metric_cell("force_nrmse", limit.get("error"))
            cells["limit of a usable one"] = metric_cell("force_nrmse", limit.get("limit"))
        rows.append(row | cells)
    leads = [_Lead(row).row() for row in differences if row["metric"] in metrics]
    groups = [
        _Lead(group).row()
        for row in differences
        if row["metric"] in metrics
        for group in row["where"]
    ]
    tables = [
        ResultTable("Mean errors on the pulses in common", rows),
        ResultTable("Differences of each pair, with 90 % intervals", leads),
    ]
    return tables + ([ResultTable("Groups that differ beyond chance", groups)] if groups else [])


#: What each shipped model of `training.models.catalogue` is, for a person who chooses.
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


def model_sentences() -> dict[str, str]:
    """What each model is, also of other packages, which describe theirs."""
    from ....training.models.serialization import added_kinds

    added = {name: model.description for name, model in added_kinds().objects.items()}
    return MODEL_SENTENCES | added
