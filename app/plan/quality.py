"""The quality of plans, as the command line and the pages show it: figures, confounding with time, a picture."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...doe.designs.imported import read_table
from ...doe.merit.quality import FIGURES, Quality, compare, figure_text, quality
from ...doe.order import time_confounding
from ...doe.plans import StoredPlan, read_plan
from ...doe.space import Space
from ...schema.atomic_write import atomic_file
from ...schema.session import Store
from ..common.number_format import finite
from ..common.plan_tables import run_counts

Designs = Mapping[str, NDArray[np.int64]]


def designs_of(store: Store, name: str, against: str | None) -> tuple[Space, Designs]:
    """The plan's treatments that are not discarded, and those of another plan, or of a table of the same factors.

    Raises `ValueError` where the other one is of other factors.
    """
    with store.reading() as session:
        plan = read_plan(session, name)
        designs = {name: plan.treatments("planned", "done")}
        if against is None:
            return plan.space, designs
        if Path(against).is_file():
            designs[Path(against).stem] = read_table(Path(against), plan.space).treatments
            return plan.space, designs
        other = read_plan(session, against)
    if other.space.axes != plan.space.axes:
        raise ValueError(f"plan {against!r} is of other factors than {name!r}; only like can be compared")
    designs[against] = other.treatments("planned", "done")
    return plan.space, designs


def tables(space: Space, designs: Designs) -> Iterator[list[dict[str, Any]]]:
    """Figures of the one or two designs, then what their order confounds with time, then the level counts."""
    names = list(designs)
    judged = [quality(space, rows) for rows in designs.values()]
    figures = compare(judged[0], judged[-1])
    yield [
        {"figure": row.figure, names[0]: row.a}
        | ({names[1]: row.b, "better": {"a": names[0], "b": names[1], "": ""}[row.better]} if len(names) > 1 else {})
        for row in figures
    ]
    confounded = [time_confounding(space, rows) for rows in designs.values()]
    yield [
        {"share of variance with time": axis}
        | {name: round(pairs[axis], 3) for name, pairs in zip(names, confounded, strict=True)}
        for axis in confounded[0]
    ]
    yield [
        {"axis": axis.name, "level": label}
        | {name: design.level_counts[axis.name][label] for name, design in zip(names, judged, strict=True)}
        for axis in space.stratified.axes
        for label in axis.labels
    ]


def figures_as_json(space: Space, designs: Designs) -> Any:
    """Figures of one design, or a list of two."""
    summaries = [
        {"plan": name, **asdict(quality(space, rows)), "time_confounding": time_confounding(space, rows)}
        for name, rows in designs.items()
    ]
    return finite(summaries if len(summaries) > 1 else summaries[0])


def plan_page(plan: StoredPlan) -> dict[str, Any]:
    """What a page shows of a plan's quality, of its runs that are not discarded; plain data.

    `counts` of runs by state, and of those that are begun; `figures`: each with its words, value, text and what is
    better ("less", "more", "neither"); `levels` by axis, each with its runs and the balanced share of them; `changes`
    by factor: how often it is changed in the order of runs, and the work that a change is; `time` by axis: the share of
    its variance that goes with time. All but `counts` are empty where no run is left.
    """
    counts = run_counts(plan)
    rows = plan.treatments("planned", "done")
    if not len(rows):
        return {"counts": counts, "figures": [], "levels": [], "changes": [], "time": []}
    judged, confounded = quality(plan.space, rows), time_confounding(plan.space, rows)
    work = {factor.name: factor.change for factor in plan.space.factors}
    return {
        "counts": counts,
        "figures": _figures(judged),
        "levels": [
            {
                "axis": axis.name,
                "share": len(rows) / axis.size,
                "levels": [{"level": label, "runs": judged.level_counts[axis.name][label]} for label in axis.labels],
            }
            for axis in plan.space.stratified.axes
        ],
        "changes": [
            {"factor": name, "changes": count, "work": work[name]} for name, count in judged.changeovers.items()
        ],
        "time": [{"axis": axis, "share": share} for axis, share in confounded.items()],
    }


def _figures(judged: Quality) -> Any:
    """Without infinities (the distance within a single run), which JSON has not."""
    rows = []
    for name, (words, better) in FIGURES.items():
        value = getattr(judged, name)
        rows.append({"name": name, "words": words, "value": value, "text": figure_text(value), "better": better})
    return finite(rows)


def draw(space: Space, designs: Designs, path: Path) -> None:
    """Draw the designs beside each other into an image file."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    from ...doe.plots import draw_quality

    figure = Figure(figsize=(6.5 * len(designs), 10), layout="constrained", dpi=120)
    FigureCanvasAgg(figure)
    draw_quality(figure, space, designs)
    with atomic_file(path) as partial:
        figure.savefig(partial)
