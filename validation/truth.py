"""An opened label in the words of the score."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..doe.factor_rules import holds
from .case_plan import CaseTask
from .case_results import WithheldTruth
from .cases.attribution import shares
from .cases.case import Label as Opened
from .stage_names import stages_of

#: An effect acts where it does more than this part of the most that it does anywhere.
_ACTS = 0.02


def label(task: CaseTask, opened: Opened) -> WithheldTruth:
    """What was withheld, as it is scored."""
    effects = tuple(name for name in opened.cause if name not in ("none", "unknown"))
    present = tuple(opened.gap)
    shown = [stage for effect in effects for stage in stages_of(effect) if stage in present]
    return WithheldTruth(
        case=task.name,
        tier=task.tier,
        kind=opened.kind,
        effects=effects,
        family=opened.family or "",
        gap_in_floors=opened.ratio,
        gap_in_tolerances=max(opened.gap.values(), default=0.0),
        stages=tuple(dict.fromkeys(shown)) if len(effects) == 1 else tuple(filter(None, [opened.stage])),
        inside=_inside(opened) if opened.region else None,
        rough=bool(opened.background.get("rough")),
        shares=shares(opened.left_out),
        shapley=shares(opened.shapley),
        shown=opened.shown,
    )


def named_regions(opened: Opened, factors: Sequence[Mapping[str, Any]]) -> list[list[int]]:
    """The configurations of each region that a report names, by its rule."""
    return [
        [i for i, row in enumerate(opened.configurations) if _holds(str(region["rule"]), row)] for region in factors
    ]


def _inside(opened: Opened) -> tuple[int, ...]:
    size = np.max([np.abs(np.array(rows)).max(axis=1) / _span(rows) for rows in opened.changes.values()], axis=0)
    return tuple(int(i) for i in np.flatnonzero(size > _ACTS))


def _span(rows: Sequence[Sequence[float]]) -> float:
    return float(np.abs(np.array(rows)).max()) or 1.0


def _holds(rule: str, factors: Mapping[str, Any]) -> bool:
    try:
        return holds(rule, factors)
    except LookupError:  # a factor that is the same all over, or made by the ingest
        return False
