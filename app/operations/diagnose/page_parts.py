"""What the page of a diagnosis and the list of diagnoses show: the path from gun to sensors,
sections as HTML, the table of effects, a headline."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from html import escape
from typing import TYPE_CHECKING, Any

from ...common.number_format import join_words, percent, percent_range
from ...twins.adopted_effects import adoptable_names, effects_of_stages
from ..operation import ResultTable
from .request import restrictions_among
from .statements import is_agreement, own_error, summary
from .tables import OF_SENTENCES, tables
from .wording import effect_subject, set_name, spell_sets

if TYPE_CHECKING:
    from ....diagnosis.verdict import Verdict

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
            note = (
                f"90 % interval {percent_range(*share.ci90)}; error "
                f"{own_error(share.own, share.own_ci90)} times the tolerance"
            )
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
                "explained by effects of sensors",
            )
        )
    else:
        cards.append(StageCard(*_STAGES[-1][1:], None, "not considered"))
    return cards


def _drawn(share: float) -> float | None:
    return min(max(share, 0.0), 1.0) if math.isfinite(share) else None


@dataclass(frozen=True)
class DiagnosisParts:
    """What the page shows of a verdict: sections as HTML (escaped where they are made) by their
    place, the tables that the first sentences take their `numbers` from, the rows of the table of
    effects (`explained`: with their figures), and what can be adopted: value of the form ->
    words."""

    sentence: str = ""
    restriction: str = ""
    path: Sequence[StageCard] = ()
    numbers: Sequence[ResultTable] = ()
    next_steps: str = ""
    before: str = ""
    after: str = ""
    assumptions: Sequence[str] = ()
    explained: bool = False
    columns: Sequence[str] = ()
    rows: Sequence[Sequence[Any]] = ()
    adoptable: Mapping[str, str] = field(default_factory=dict)


def parts_of(verdict: Verdict) -> DiagnosisParts:
    """All that the page draws."""
    from .report import (
        ASSUMPTIONS,
        CAUSES,
        EFFECT_COLUMNS,
        EFFECTS,
        FIRST_SECTIONS,
        NEXT_EXPERIMENT,
        sections,
    )

    steps, before = (FIRST_SECTIONS[0], NEXT_EXPERIMENT), (FIRST_SECTIONS[1], CAUSES)
    titled = {
        section.title: section
        for section in sections(verdict)
        if section.title not in (EFFECTS, ASSUMPTIONS)
    }
    after = [title for title in titled if title not in (*steps, *before)]
    return DiagnosisParts(
        sentence=summary(verdict),
        restriction=" ".join(restrictions_among(verdict.assumptions)),
        path=stage_cards(verdict),
        numbers=[
            part
            for part in tables(verdict)
            if isinstance(part, ResultTable) and part.title in OF_SENTENCES
        ],
        next_steps=_html(titled, steps),
        before=_html(titled, before),
        after=_html(titled, after),
        assumptions=verdict.assumptions,
        explained=bool(verdict.effects),
        columns=EFFECT_COLUMNS if verdict.effects else EFFECT_COLUMNS[:2],
        rows=_rows(verdict),
        adoptable={name: _adoptable_words(name) for name in adoptable_names(verdict)},
    )


def _adoptable_words(name: str) -> str:
    """`a/b+c` as "the mean of a and b, with c"."""
    sets = [part.split("/") for part in name.split("+")]
    if all(len(own) == 1 for own in sets):
        return spell_sets(name)
    averaged = [f"the mean of {join_words(own)}" for own in sets if len(own) > 1]
    others = [own[0] for own in sets if len(own) == 1]
    return join_words(averaged) + (f", with {join_words(others)}" if others else "")


def _html(titled: Mapping[str, Any], titles: Sequence[str]) -> str:
    from .report import section_html

    return "".join(
        f"<section><h2>{escape(title)}</h2>{section_html(titled[title])}</section>"
        for title in titles
        if title in titled
    )


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
