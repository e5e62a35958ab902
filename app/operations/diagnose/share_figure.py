"""The shares of the sets of effects for a page: each set with its interval, the effects of a set
that these runs cannot tell apart below it, other effects, and what none explains."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from ....diagnosis.verdict import EffectShare, Verdict
from ...common.number_format import percent, percent_with_range
from ...figures.figure import ColourRole, Plot, PlotAxis
from .report_charts import BarRow, bars_plot
from .waterfall import bars_height, short_names
from .wording import unexplained_interval

#: Bars at most: the table has all effects.
_MOST_ROWS = 10
#: An effect of no set with a smaller share has no bar.
_LEAST_SHARE = 0.005


def share_bars(verdict: Verdict) -> tuple[BarRow, ...]:
    """The bars in per cent of the squared error; () for a diagnosis without shares."""
    if not verdict.effects:
        return ()
    rows = list(_of_sets(verdict))
    members = {name for own in verdict.cause_sets for name in own.effects}
    others = [row for row in verdict.effects if row.effect not in members]
    others = [row for row in others if abs(row.share) >= _LEAST_SHARE] or others[:3]
    others.sort(key=lambda row: -abs(row.share))
    room = max(_MOST_ROWS - len(rows) - 1, 0)
    rows += [_of_effect(row, ColourRole.OTHER) for row in others[:room]]
    if verdict.unexplained is not None:
        rest = verdict.unexplained
        rows.append(_bar("unexplained", rest.share, unexplained_interval(rest), ColourRole.BEFORE))
    return tuple(row for row in rows if math.isfinite(row.start + row.end))


def _of_sets(verdict: Verdict) -> Iterator[BarRow]:
    shares = {row.effect: row for row in verdict.effects}
    for own in verdict.cause_sets:
        ending = ", not told apart" if len(own.effects) > 1 else ""
        yield _bar(f"{short_names(own.effects)}{ending}", own.share, own.ci90, ColourRole.CAUSE)
        if len(own.effects) > 1:
            yield from (
                _of_effect(shares[name], ColourRole.CATEGORY_5, "of these: ")
                for name in own.effects
                if name in shares
            )


def _of_effect(row: EffectShare, role: ColourRole, start: str = "") -> BarRow:
    return _bar(f"{start}{short_names([row.effect])}", row.share, row.ci90, role)


def _bar(name: str, share: float, ci90: Sequence[float], role: ColourRole) -> BarRow:
    low, high = (100 * end for end in ci90)
    drawable = math.isfinite(low + high)
    value = percent_with_range(share, (ci90[0], ci90[1])) if drawable else percent(share)
    ends = min(0.0, 100 * share), max(0.0, 100 * share)
    return BarRow(name, value, *ends, role, (low, high) if drawable else None)


def share_figure(verdict: Verdict) -> Plot | None:
    """The figure; None for a diagnosis without shares."""
    rows = share_bars(verdict)
    if not rows:
        return None
    axis = PlotAxis("share of the squared error, 90 % intervals", "%")
    plot = bars_plot("Shares of the sets of effects", axis, rows)
    return replace(plot, height=bars_height(len(rows)))
