"""What the page of a diagnosis and the list of diagnoses show: the sentences, the figures and the
boxes of the first screens, the path from gun to sensors, and below them sections as HTML and
tables."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ....diagnosis.verdict import LEAST_FRACTION
from ...common.number_format import join_words, percent
from ...twins.adopted_effects import adoptable_names, effects_of_stages
from ..operation import ResultTable
from .effect_boxes import (
    EffectBox,
    computed_names,
    effect_boxes,
    job_words,
    shown_words,
    ticked_at_first,
)
from .headline import headline, size_words
from .place_figure import place_plot
from .recommendations import next_experiment, next_steps
from .report import section_html
from .report_charts import curve_plot, residual_plot
from .request import restrictions_among
from .residual_figures import (
    largest_residual,
    residual_choices,
    residual_figures,
    run_points,
)
from .share_figure import share_figure
from .statements import answer, drawn_effects, is_agreement, own_error, summary
from .tables import tables
from .waterfall import computed_set, level_table, path_names, waterfall_plot
from .wording import effect_subject, set_name, spell_sets

if TYPE_CHECKING:
    from ....diagnosis.verdict import Verdict
    from ...figures.figure import Plot

#: The path of a shot, stage by stage: id, name, and what is compared there.
_STAGES = (
    ("gun", "Gun", "muzzle velocity"),
    ("contact", "Contact", "force of the impact"),
    ("plate", "Plate", "response of the plate"),
    ("sensor", "Sensors", "readings"),
)


@dataclass(frozen=True)
class StageCard:
    """A stage on the path of a shot: its share of the error from 0 to 1 (None: not compared), and
    in words."""

    name: str
    quantity: str
    share: float | None
    text: str
    note: str = ""


def stage_cards(verdict: Verdict) -> list[StageCard]:
    """Gun, contact, plate and sensors with their shares of the error.

    The stages share the error among them. The sensors are no stage: theirs is the share that
    effects of the sensors explain, which is part of the shares of the stages.
    """
    shares = {stage.name: stage for stage in verdict.where.stage}
    cards = []
    for stage, name, quantity in _STAGES[:-1]:
        if stage in shares:
            share = shares[stage]
            note = f"own error {own_error(share.own, share.own_ci90)} tolerances"
            cards.append(StageCard(name, quantity, _drawn(share.share), percent(share.share), note))
        else:
            cards.append(StageCard(name, quantity, None, "not compared"))
    sensors = [
        effect.share for effect in verdict.effects if effect.effect.startswith(f"{_STAGES[-1][0]}.")
    ]
    if sensors:
        cards.append(
            StageCard(
                *_STAGES[-1][1:],
                _drawn(sum(sensors)),
                percent(sum(sensors)),
                "explained by their effects"
                if sum(sensors) > -LEAST_FRACTION
                else "their effects hide a part of the error",
            )
        )
    else:
        cards.append(StageCard(*_STAGES[-1][1:], None, "not considered"))
    return cards


def _drawn(share: float) -> float | None:
    return min(max(share, 0.0), 1.0) if math.isfinite(share) else None


@dataclass(frozen=True)
class FoldedSection:
    """A section below the figures: its title, its content as HTML, escaped where it is made."""

    title: str
    html: str


@dataclass(frozen=True)
class DiagnosisParts:
    """What the page shows of a verdict: the `headline` and what its sizes are of; the figures; the
    boxes, which of them are ticked, and the sets that were computed; what to do next, and what can
    be adopted (value of the form -> words); all sentences, tables and sections below; and what a
    diagnosis of an earlier version `lacks`."""

    headline: Sequence[str] = ()
    size_words: str = ""
    restriction: str = ""
    path: Sequence[StageCard] = ()
    waterfall: Plot | None = None
    shares: Plot | None = None
    places: Plot | None = None
    residual_choices: Sequence[str] = ()
    residual_first: int = 0
    residuals: Sequence[Plot] = ()
    addresses: Sequence[str] = ()
    boxes: Sequence[EffectBox] = ()
    ticked: Sequence[str] = ()
    of_report: Sequence[str] = ()
    shown_words: str = ""
    not_computed: str = ""
    computed: Sequence[Sequence[str]] = ()
    computed_rows: Sequence[Mapping[str, str]] = ()
    job_words: str = ""
    next_steps: Sequence[str] = ()
    next_runs: Sequence[str] = ()
    adoptable: Mapping[str, str] = field(default_factory=dict)
    sentences: Sequence[str] = ()
    numbers: Sequence[ResultTable] = ()
    records: Sequence[Plot] = ()
    record_words: str = ""
    sections: Sequence[FoldedSection] = ()
    assumptions: Sequence[str] = ()
    explained: bool = False
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[Any]] = ()
    lacks: Sequence[str] = ()


def parts_of(
    verdict: Verdict,
    impacts: Mapping[tuple[int, int], int] | None = None,
    names: Sequence[str] | None = None,
    restricted_to: Collection[str] = (),
) -> DiagnosisParts:
    """All that the page draws. `impacts`: the store's number of an impact by run and repetition;
    `names`: the effects that are ticked, by default those of the report's path; `restricted_to`:
    the effects that the diagnosis considered alone."""
    from .report import (
        ASSUMPTIONS,
        EFFECT_COLUMNS,
        EFFECTS,
        FIRST_SECTIONS,
        NEXT_EXPERIMENT,
        RESIDUALS,
    )
    from .report import sections as report_sections

    points = run_points(verdict, impacts)
    ticked = ticked_at_first(verdict, restricted_to) if names is None else tuple(names)
    shown = ticked
    not_computed = ""
    if names is not None and computed_set(verdict, ticked) is None and ticked:
        shown = ticked_at_first(verdict)
        not_computed = f"This combination was not computed. {shown_words(verdict, shown)}"
    is_path = verdict.what_if is None or frozenset(shown) == frozenset(path_names(verdict))
    steps = [item.text for item in next_steps(verdict)]
    experiment = [item.text for item in next_experiment(verdict)]
    drawn_above = (EFFECTS, ASSUMPTIONS, *FIRST_SECTIONS, NEXT_EXPERIMENT, RESIDUALS)
    return DiagnosisParts(
        headline=[item.text.replace(" %", "\u00a0%") for item in headline(verdict)],
        size_words=size_words(verdict, len(verdict.pictures.configurations)),
        restriction=" ".join(restrictions_among(verdict.assumptions)),
        path=stage_cards(verdict),
        waterfall=waterfall_plot(verdict, None if is_path else _computed_only(verdict, shown)),
        shares=share_figure(verdict),
        places=place_plot(verdict),
        residual_choices=residual_choices(verdict),
        residual_first=largest_residual(verdict),
        residuals=list(residual_figures(verdict, computed_set(verdict, shown), points)),
        addresses=[point.address for point in points],
        boxes=effect_boxes(verdict),
        ticked=ticked,
        of_report=ticked_at_first(verdict, restricted_to),
        shown_words=shown_words(
            verdict, shown if verdict.what_if is not None else path_names(verdict)
        ),
        not_computed=not_computed,
        computed=computed_names(verdict),
        computed_rows=list(level_table(verdict)),
        job_words=job_words(verdict),
        next_steps=steps,
        next_runs=[line for line in experiment if line not in steps],
        adoptable={name: _adoptable_words(name) for name in adoptable_names(verdict)},
        sentences=[item.text for item in answer(verdict)],
        numbers=[part for part in tables(verdict) if isinstance(part, ResultTable)],
        records=_records(verdict),
        record_words=drawn_effects(verdict),
        sections=[
            FoldedSection(section.title, section_html(section))
            for section in report_sections(verdict)
            if section.title not in drawn_above
        ],
        assumptions=verdict.assumptions,
        explained=bool(verdict.effects),
        columns=EFFECT_COLUMNS if verdict.effects else EFFECT_COLUMNS[:2],
        rows=_rows(verdict),
        lacks=lacks(verdict),
    )


def _records(verdict: Verdict) -> list[Plot]:
    """Records beside their simulation; of an older diagnosis, which has no runs, the residuals of
    its configurations first."""
    pictures = verdict.pictures
    residuals = pictures.residuals if verdict.what_if is None else ()
    plots = [residual_plot(picture, pictures.configurations) for picture in residuals]
    return [*plots, *(curve_plot(picture) for picture in pictures.curves)]


def _computed_only(verdict: Verdict, names: Sequence[str]) -> Sequence[str]:
    """The names where the error with them was computed; else none of them."""
    return names if computed_set(verdict, names) is not None else ()


def lacks(verdict: Verdict) -> list[str]:
    """What a diagnosis does not hold, because an earlier version made it or because its campaign
    does not allow it; each a sentence."""
    advice = f"diagnose again (pyroshock diagnose {verdict.campaign})"
    sentences = []
    if not verdict.effects:
        sentences.append(f"It holds no shares of effects and no path of the error: {advice}.")
    if verdict.what_if is None:
        sentences.append(
            "It was made by an earlier version and holds no residuals of single runs, no errors "
            f"with other sets of effects and no errors by settings: {advice}."
        )
    elif not verdict.what_if.sets:
        sentences.append(
            "No set of effects could be tested on configurations that the fit has not seen: the "
            "campaign has fewer than two configurations that can be compared."
        )
    return sentences


def _adoptable_words(name: str) -> str:
    """`a/b+c` as "the mean of a and b, with c"."""
    sets = [part.split("/") for part in name.split("+")]
    if all(len(own) == 1 for own in sets):
        return spell_sets(name)
    averaged = [f"the mean of {join_words(own)}" for own in sets if len(own) > 1]
    others = [own[0] for own in sets if len(own) == 1]
    return join_words(averaged) + (f", with {join_words(others)}" if others else "")


def _rows(verdict: Verdict) -> list[tuple[Any, ...]]:
    """The effects with their figures, then those that the diagnosis did not look at, and what is
    unexplained."""
    from .report import EFFECT_COLUMNS, effect_rows

    rows = effect_rows(verdict)
    shown = {effect.effect for effect in verdict.effects}
    blank = ("",) * (len(EFFECT_COLUMNS) - 2 if shown else 0)
    others = [
        (name, effect_subject(name), *blank)
        for name in effects_of_stages(verdict)
        if name not in shown
    ]
    last = len(rows) - (verdict.unexplained is not None)
    return [*rows[:last], *others, *rows[last:]]


def list_row(row: Mapping[str, Any], verdict: Verdict) -> dict[str, Any]:
    """A row of the list of diagnoses: size of the error, its causes with their shares, and the
    shares of the stages."""
    stages = [f"{stage.name} {percent(stage.share)}" for stage in verdict.where.stage]
    return {
        **row,
        "adopted": row["adopted"] and spell_sets(row["adopted"]),
        "sentence": f"{summary(verdict).partition('. ')[0].rstrip('.')}.",
        "causes": _causes(verdict).replace(" %", "\u00a0%"),
        "stages": ", ".join(stages).replace(" %", "\u00a0%"),
    }


def _causes(verdict: Verdict) -> str:
    if is_agreement(verdict):
        return "none needed"
    sets = verdict.cause_sets
    if not sets:
        names = [
            effect_subject(part) for name in verdict.first.effects[:1] for part in name.split("+")
        ]
        return f"{join_words(names)} ({percent(verdict.first.probability)})"
    return ", ".join(
        f"{set_name(own.effects).removeprefix('the ')} {percent(own.share)}" for own in sets
    )
