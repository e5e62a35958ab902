"""The quality of plans, as the command line and the pages show it: a verdict with its reasons,
figures between the best possible and a random plan, power, confounding."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ....doe.merit.best_possible import best_possible, random_reference
from ....doe.merit.model_terms import USUAL_EFFECT
from ....doe.merit.pair_balance import level_labels, pair_matrix
from ....doe.merit.quality import FIGURES, compare, figure_text
from ....doe.merit.verdict import Judgement, judge
from ....doe.plans import StoredPlan
from ....doe.space import Space
from ...common.number_format import finite
from ...common.plan_tables import run_counts

Designs = Mapping[str, NDArray[np.int64]]


def judged_designs(
    space: Space, designs: Designs, effect: float = USUAL_EFFECT
) -> dict[str, Judgement]:
    """The one or two designs, judged; `effect` is the one of the power, in standard deviations of a
    run.

    Raises `ValueError` where a design has no run.
    """
    return {name: judge(space, treatments, effect) for name, treatments in designs.items()}


def tables(
    space: Space, judged: Mapping[str, Judgement]
) -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Title and rows of each table: the figures beside what is best possible and what random runs
    reach, the power, what the order confounds with time, the counts of levels."""
    names, (first, *_, last) = list(judged), [*judged.values(), *judged.values()]
    best, drawn = (
        best_possible(space, first.quality.runs),
        random_reference(space, first.quality.runs),
    )
    rows = []
    for name, row in itertools.zip_longest(FIGURES, compare(first.quality, last.quality)):
        cells = {"figure": row.figure, names[0]: row.a}
        if len(names) > 1:
            cells |= {names[1]: row.b, "better": {"a": names[0], "b": names[1], "": ""}[row.better]}
        rows.append(
            cells
            | {"best possible": figure_text(best.get(name)), "random plan": _reference(name, drawn)}
        )
    if last.quality.runs != first.quality.runs:
        rows = [
            {
                key: value
                for key, value in row.items()
                if key not in ("best possible", "random plan")
            }
            for row in rows
        ]
    yield "", rows
    yield (
        f"Power for an effect of {first.effect:g} standard deviations of a run",
        [
            {"main effect": term.term.replace("_", " "), "levels": term.levels}
            | {
                f"{heading}{f', {name}' if len(names) > 1 else ''}": text
                for name, judgement in judged.items()
                for heading, text in _power_cells(judgement, index).items()
            }
            for index, term in enumerate(first.power)
        ],
    )
    yield (
        "Share of the variance that goes with time",
        [
            {"factor": axis.replace("_", " ")}
            | {name: f"{judgement.time[axis]:.2f}" for name, judgement in judged.items()}
            for axis in first.time
        ],
    )
    yield (
        "Runs of each level",
        [
            {"factor": axis.name.replace("_", " "), "level": label}
            | {
                name: judgement.quality.level_counts[axis.name][label]
                for name, judgement in judged.items()
            }
            for axis in space.stratified.axes
            for label in axis.labels
        ],
    )


def _reference(name: str | None, drawn: Mapping[str, float]) -> str:
    """A random plan's figure, without those that are the plan's size."""
    return "" if name is None or name == "runs" else figure_text(drawn[name])


def _power_cells(judgement: Judgement, index: int) -> dict[str, str]:
    if index >= len(judgement.power):  # another design has one level of a factor in use
        return {"power": "", "seen with 80 %": "", "variance inflation": ""}
    term = judgement.power[index]
    return {
        "power": f"{100 * term.power:.0f} %",
        "seen with 80 %": "none"
        if math.isinf(term.smallest_effect)
        else f"{term.smallest_effect:.2g} sd",
        "variance inflation": "infinite"
        if math.isinf(term.variance_inflation)
        else f"{term.variance_inflation:.2f}",
    }


def verdict_lines(judged: Mapping[str, Judgement]) -> Iterator[str]:
    """The verdict of each design, then a line for each reason and one for its cure."""
    for name, judgement in judged.items():
        yield (
            f"{name}: {judgement.verdict.sentence}"
            if len(judged) > 1
            else judgement.verdict.sentence
        )
        for reason in judgement.verdict.reasons:
            yield f"  {reason.weight}: {reason.text}"
            yield f"    {reason.cure}"


def figures_as_json(space: Space, judged: Mapping[str, Judgement]) -> Any:
    """Figures of one design, or a list of two."""
    summaries = [
        {
            "plan": name,
            **asdict(judgement.quality),
            "time_confounding": judgement.time,
            **judgement_as_json(space, judgement),
        }
        for name, judgement in judged.items()
    ]
    return finite(summaries if len(summaries) > 1 else summaries[0])


def judgement_as_json(space: Space, judgement: Judgement) -> dict[str, Any]:
    """The verdict with its reasons, the bounds of the figures, the power and the correlations of
    the terms."""
    runs = judgement.quality.runs
    return {
        "verdict": asdict(judgement.verdict),
        "best_possible": best_possible(space, runs),
        "random_plan": dict(random_reference(space, runs)),
        "effect": judgement.effect,
        "power": [asdict(term) for term in judgement.power],
        "terms": list(judgement.terms),
        "correlations": np.round(judgement.correlations, 4).tolist(),
    }


#: What `plan_page` leaves empty where no run is left.
_OF_RUNS = (
    "figures",
    "levels",
    "changes",
    "time",
    "power",
    "terms",
    "correlations",
    "pair_labels",
    "pairs",
)


def plan_page(plan: StoredPlan) -> dict[str, Any]:
    """What a page shows of a plan's quality, of its runs that are not discarded; plain data.

    `counts` of runs by state, and of those that are begun; `verdict`; `figures`: each with its
    words, value, text, what is better ("less", "more", "neither"), the best possible and that of a
    random plan; `levels` by axis, each with its runs and the balanced share of them; `changes` by
    factor: how often it is changed in the order of runs, and the work that a change is; `time` by
    axis: the share of its variance that goes with time; `power` by main effect; `terms` and their
    `correlations`, the first `mains` of which are main effects; `pairs`
    (`doe.merit.pair_balance.pair_matrix`) with `pair_labels`. Where no run is left, the verdict is
    None and all others but `counts` are empty.
    """
    counts = run_counts(plan)
    rows = plan.treatments("planned", "done")
    if not len(rows):
        return {"counts": counts, "verdict": None, "mains": 0} | {name: [] for name in _OF_RUNS}
    judgement = judge(plan.space, rows)
    work = {factor.name: factor.change for factor in plan.space.factors}
    judgement_facts = judgement_as_json(plan.space, judgement)
    facts: dict[str, Any] = finite(
        {
            "counts": counts,
            "verdict": judgement_facts["verdict"],
            "mains": judgement.mains,
            "figures": _figures(
                judgement, judgement_facts["best_possible"], judgement_facts["random_plan"]
            ),
            "levels": [
                {
                    "axis": axis.name,
                    "share": len(rows) / axis.size,
                    "levels": [
                        {"level": label, "runs": judgement.quality.level_counts[axis.name][label]}
                        for label in axis.labels
                    ],
                }
                for axis in plan.space.stratified.axes
            ],
            "changes": [
                {"factor": name, "changes": count, "work": work[name]}
                for name, count in judgement.quality.changeovers.items()
            ],
            "time": [{"axis": axis, "share": share} for axis, share in judgement.time.items()],
            **{
                name: judgement_facts[name] for name in ("power", "terms", "correlations", "effect")
            },
            "pair_labels": level_labels(plan.space),
            "pairs": np.round(pair_matrix(plan.space, rows), 4).tolist(),
        }
    )
    return facts


def _figures(
    judgement: Judgement, best: Mapping[str, float], drawn: Mapping[str, float]
) -> list[dict[str, Any]]:
    rows = []
    for name, (words, better) in FIGURES.items():
        value = getattr(judgement.quality, name)
        rows.append(
            {
                "name": name,
                "words": words,
                "value": value,
                "text": figure_text(value),
                "better": better,
                "best_possible": figure_text(best.get(name)),
                "random_plan": _reference(name, drawn),
            }
        )
    return rows
