"""The boxes of a diagnosis's page: effects to tick, for which the waterfall and the residuals show
the error with exactly these; which combinations were computed, and what any other costs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ....diagnosis.verdict import OTHERS, Verdict
from ...common.number_format import join_words, percent
from ...figures.page_renderer import figure_data
from ...twins.adopted_effects import effects_of_stages
from .residual_figures import RunPoint, residual_figures
from .waterfall import added_words, computed_set, path_names, waterfall_plot
from .wording import sentence_start

#: A diagnosis that took longer is not offered anew from the page: that would block a worker.
_CHEAP_S = 900.0


@dataclass(frozen=True)
class EffectBox:
    """A box: `name` as computed sets and the form have it, what it is in words, the share of the
    error beside it ("" where none is computed), and whether any computed set has it."""

    name: str
    words: str
    share: str
    computed: bool


def effect_boxes(verdict: Verdict) -> tuple[EffectBox, ...]:
    """The steps of the path, the effects of the catalogue by their shares, then those that the
    diagnosis did not look at."""
    computed = set(verdict.what_if.names) if verdict.what_if is not None else set()
    share_of = {own.name: own.share for own in verdict.named_sets}
    share_of |= {row.effect: row.share for row in verdict.effects}
    names = list(path_names(verdict)) if computed else []
    names += [row.effect for row in verdict.effects]
    names += effects_of_stages(verdict)
    ordered = [name for name in dict.fromkeys(names) if name != OTHERS]
    if OTHERS in computed:
        ordered.insert(len([name for name in path_names(verdict) if name != OTHERS]), OTHERS)
    return tuple(
        EffectBox(
            name,
            sentence_start(_box_words(name)),
            percent(share_of[name]).replace(" ", "\u00a0") if name in share_of else "",
            name in computed,
        )
        for name in ordered
    )


def _box_words(name: str) -> str:
    if name == OTHERS:
        return f"{OTHERS}, as all fitted together"
    return f"{added_words(name)} (the mean of these)" if " or " in name else added_words(name)


def ticked_at_first(verdict: Verdict, restricted_to: Collection[str] = ()) -> tuple[str, ...]:
    """The boxes that are ticked when the page opens: the report's path; of a diagnosis without one
    the effects that it was restricted to."""
    names = path_names(verdict) if verdict.what_if is not None else ()
    return names or tuple(restricted_to)


def computed_names(verdict: Verdict) -> list[list[str]]:
    """The names of every computed set, and of no effect at all."""
    return [[], *(list(own.effects) for own in verdict.what_if.sets)] if verdict.what_if else []


def figures_with(
    verdict: Verdict, names: Sequence[str], points: Sequence[RunPoint]
) -> dict[str, Any]:
    """The waterfall, and of each residual figure the points with these effects and the ends of its
    axis, as `static/diagnosis.js` takes them. Raises `LookupError` for a set that was not
    computed."""
    names = tuple(dict.fromkeys(names))
    is_path = frozenset(names) == frozenset(path_names(verdict))
    waterfall = waterfall_plot(verdict, None if is_path and names else names)
    shown = computed_set(verdict, names) if names else None
    figures = [figure_data(plot) for plot in residual_figures(verdict, shown, points)]
    return {
        "waterfall": None if waterfall is None else figure_data(waterfall),
        "residuals": [
            {
                "after": figure["series"][-1]["y"] if shown is not None else None,
                "limits": figure["y"]["limits"],
            }
            for figure in figures
        ],
        "words": shown_words(verdict, names),
    }


def shown_words(verdict: Verdict, names: Sequence[str]) -> str:
    """What is shown, above the waterfall."""
    if not names:
        return "Shown: the nominal model, without any effect."
    if frozenset(names) == frozenset(path_names(verdict)):
        return "Shown: the effects of the report, the largest share first."
    return f"Shown: {join_words([added_words(name) for name in names])}."


def job_words(verdict: Verdict) -> str:
    """What a diagnosis with other effects costs; "" where it would be too long for a page."""
    if not verdict.seconds <= _CHEAP_S:
        return ""
    minutes = verdict.seconds / 60
    if minutes < 1.5:
        return f"about {max(round(verdict.seconds, -1), 10):.0f} s"
    return f"about {minutes:.0f} minutes"


def effects_of_form(texts: Mapping[str, Sequence[str]], field: str) -> list[str]:
    """Ids of effects that were ticked: a set stands for all of its effects, and the effects that
    are not established for none that can be named."""
    names = [name for text in texts.get(field, ()) for name in text.split(" or ")]
    return [name for name in dict.fromkeys(names) if name != OTHERS]
