"""A diagnosis as a report: sections that the terminal, the page of `diagnose --html`, the web
application and the PDF share. A kept diagnosis comes with all that its page draws, one of an older
store with the numbers alone."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from ....diagnosis.verdict import (
    CORRECTED,
    NONE,
    UNKNOWN,
    Cause,
    EffectSet,
    EffectShare,
    ResidualPicture,
    Verdict,
    stage_figure,
)
from ....files.atomic_write import write_text
from ....schema.diagnoses import Diagnosis
from ....schema.known_factors import BY_COLUMN
from ...common.number_format import (
    join_words,
    number,
    percent,
    percent_range,
    percent_with_range,
    times,
)
from ...documents.document import (
    Bars,
    Block,
    Bullets,
    Cell,
    ChartRow,
    Document,
    Paragraph,
    Section,
    ShareBar,
    Table,
)
from ...documents.page import blocks_html, html_of
from .place_figure import place_plot
from .report_charts import curve_plot, residual_plot
from .request import restrictions_among
from .share_figure import share_figure
from .statements import drawn_effects as drawn_effects_sentence
from .statements import summary
from .stored import FORMAT, kept_report, kept_verdict, verdict_from_json
from .texts import next_experiment, recommendations, shrinkage_line, where_lines
from .waterfall import waterfall_plot
from .wording import (
    ACTS,
    cause_lines,
    cause_title,
    effect_subject,
    fitted_words,
    set_name,
    single_effects,
    unexplained_interval,
)

#: Figures of a file: with them a diagnosis fits two pages of A4.
_MOST_FIGURES = 6
#: Of the effects that no answer names, those from this share on have a row in the table of a file.
_WORTH_A_ROW = 0.005
#: The section whose table the web application shows with boxes to tick, and those before it.
EFFECTS = "Effects"
FIRST_SECTIONS = ("What to do next", "How far the error shrinks, and what causes it")
CAUSES, NEXT_EXPERIMENT, ASSUMPTIONS = "Causes", "The next experiment", "Assumptions"
RESIDUALS = "Residuals before and after"


def write_page(verdict: Verdict, path: Path) -> None:
    """Write the page to `path`, whose folder is made. Raises `OSError`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, page(verdict))


def page(verdict: Verdict) -> str:
    """The page as HTML; every text from a campaign is escaped."""
    return html_of(document_of(verdict, f"made in {number(verdict.seconds)} s", None))


def document_of(verdict: Verdict, name: str, date: dt.date | None) -> Document:
    """The report on a verdict; `name` says which diagnosis it is."""
    facts = {"Diagnosis": name, "Simulator": verdict.simulator}
    if restrictions := restrictions_among(verdict.assumptions):
        facts["Restriction"] = " ".join(restrictions)
    return Document(
        kind="Diagnosis",
        title=verdict.campaign,
        lead=summary(verdict),
        facts=facts,
        sections=sections(verdict, _MOST_FIGURES),
        date=date,
    )


def sentence_sections(verdict: Verdict) -> dict[str, tuple[str, ...]]:
    """The sentences of each section that is made of sentences alone, by title."""
    return {
        FIRST_SECTIONS[0]: recommendations(verdict),
        "Where the error lies": tuple(where_lines(verdict.where)),
        "On configurations that the fit has not seen": tuple(
            shrinkage_line(entry, verdict) for entry in verdict.shrinkage
        ),
        NEXT_EXPERIMENT: next_experiment(verdict),
        ASSUMPTIONS: verdict.assumptions,
    }


def sections(verdict: Verdict, most_figures: int | None = None) -> tuple[Section, ...]:
    """All of the report but its title; sections without anything to show are left out.

    With `most_figures` only the residuals that are largest beside their tolerance are drawn.
    """
    sentences = sentence_sections(verdict)

    further = [
        line for line in sentences[NEXT_EXPERIMENT] if line not in sentences[FIRST_SECTIONS[0]]
    ]

    def listed(title: str, empty: str, *further: Block) -> Section:
        return Section(title, [Bullets(sentences[title], empty), *further])

    every = (
        listed(FIRST_SECTIONS[0], "None."),
        Section(FIRST_SECTIONS[1], _path_and_shares(verdict)),
        Section(EFFECTS, _effects(verdict)),
        Section(CAUSES, [Bars([_bar(cause) for cause in verdict.causes])]),
        listed("Where the error lies", "No place stands out.", _size(verdict), *_places(verdict)),
        Section(RESIDUALS, _pictures(verdict, most_figures)),
        listed(
            "On configurations that the fit has not seen",
            "Not measured.",
            *_unseen_figures(verdict),
        ),
        Section(NEXT_EXPERIMENT, [Bullets(further, "None.")] if further else []),
        Section(
            ASSUMPTIONS,
            [Bullets(verdict.assumptions, "None beyond the campaign's own numbers.", quiet=True)],
        ),
    )
    return tuple(section for section in every if section.blocks)


def section_html(section: Section) -> str:
    """The blocks of a section as HTML, every text escaped."""
    return blocks_html(section.blocks)


#: Title and caption of the pictures that the page of a diagnosis shows, too.
WATERFALL = (
    "What takes the error away",
    "The error in tolerances on configurations that the fit has not seen, with 90 % intervals; "
    "below the repeatability nothing can go.",
)
SHARES = (
    "Which effects, and how much",
    "Shares of the squared error of all configurations; a negative share hides a part of it. Blue: "
    "established as causes.",
)
PLACES = (
    "Map of the error",
    "Error of the nominal model by stage, stretch of time and band of frequency, over all runs and "
    "over the levels of the settings. No colour: below one tolerance.",
)


def _places(verdict: Verdict) -> list[Block]:
    plot = place_plot(verdict)
    if plot is None:
        return []
    title, caption = PLACES
    return [ChartRow([replace(plot, title=title, notes=(*plot.notes, caption))], wide=True)]


def _path_and_shares(verdict: Verdict) -> list[Block]:
    figures = [
        replace(plot, title=title, notes=(*plot.notes, caption))
        for plot, (title, caption) in (
            (waterfall_plot(verdict) if verdict.path else None, WATERFALL),
            (share_figure(verdict), SHARES),
        )
        if plot is not None
    ]
    if not figures:
        return []
    return [
        ChartRow(figures),
        Paragraph(
            "The path adds one set of effects after the other and measures the error on "
            "configurations that the fit has not seen.",
            quiet=True,
        ),
    ]


#: The heading of a gain held out; the path has no such figures, for its effects come one after the
#: other.
GAIN = "adds held out"
#: Headings of the table of effects.
EFFECT_COLUMNS = (
    "effect", "name", "share", "90 % interval", ACTS, GAIN, "set", "cause", "parameters"
)  # fmt: skip


#: What the column "cause" says: established by itself or as a set, one of a set, in the first
#: answer, or none of these.
_ESTABLISHED, _OF_SET, _POSSIBLE, _NO = "yes", "in set", "possible", "no"


def effect_rows(verdict: Verdict) -> list[tuple[Cell, ...]]:
    """A row for each set and for each effect under `EFFECT_COLUMNS`, and a last one for what is
    unexplained."""
    rows: list[tuple[Cell, ...]] = []
    for row in _table_order(verdict):
        name = set_name(row.effects) if isinstance(row, EffectSet) else effect_subject(row.effect)
        single = row if isinstance(row, EffectShare) else None
        rows.append(
            (
                row.name if isinstance(row, EffectSet) else row.effect,
                name,
                percent(row.share),
                percent_range(*row.ci90) if math.isfinite(sum(row.ci90)) else "",
                percent(row.inclusion),
                percent(row.held_out_gain),
                set_number(verdict, row),
                cause_word(verdict, row),
                ", ".join(fitted_words(item, single.effect) for item in single.parameters)
                if single
                else "",
            )
        )
    if verdict.unexplained is not None:
        rest = verdict.unexplained
        interval = percent_range(*unexplained_interval(rest))
        rows.append(("unexplained", "", percent(rest.share), interval, "", "", "", "", ""))
    return rows


def _table_order(verdict: Verdict) -> Iterator[EffectSet | EffectShare]:
    """The sets that are causes, by falling share, each of several before its effects; then the
    other effects."""
    effects = {row.effect: row for row in verdict.effects}
    for own in verdict.cause_sets:
        if len(own.effects) > 1:
            yield own
        yield from (effects.pop(name) for name in own.effects if name in effects)
    yield from effects.values()


def set_number(verdict: Verdict, row: EffectSet | EffectShare) -> int | None:
    """The number of the set that a row of the table is, or is of; None for an effect of no set."""
    members = set(row.effects) if isinstance(row, EffectSet) else {row.effect}
    return next(
        (i for i, own in enumerate(verdict.cause_sets, start=1) if members <= set(own.effects)),
        None,
    )


def cause_word(verdict: Verdict, row: EffectSet | EffectShare) -> str:
    """Whether a set or an effect is a cause, as the table says it: an effect of the first answer is
    never "no"."""
    number_of_set = set_number(verdict, row)
    if number_of_set is not None:
        alone = (
            isinstance(row, EffectSet) or len(verdict.cause_sets[number_of_set - 1].effects) == 1
        )
        return _ESTABLISHED if alone else f"{_OF_SET} {number_of_set}"
    members = set(row.effects) if isinstance(row, EffectSet) else {row.effect}
    return _POSSIBLE if members & set(single_effects(verdict.first.effects)) else _NO


EFFECTS_CAPTION = (
    "Share of the squared error with its 90 % interval, probability that the effect acts, and how "
    "much more of the error disappears with it than without it on configurations that the fit has "
    "not seen (adds held out). Without it, the other likely effects are fitted again and may take "
    "a part of its place; the path adds the first effect to the nominal model, so that more can "
    "disappear there. Of the effects of one set at least one acts, and these runs cannot tell "
    "which; its first row is that of the set."
)


def _effects(verdict: Verdict) -> list[Block]:
    """The effects that matter with a row each; the others in a sentence, so that a printed report
    stays short."""
    if not verdict.effects:
        return []
    shown = [
        row
        for row in _table_order(verdict)
        if isinstance(row, EffectSet)
        or cause_word(verdict, row) != _NO
        or abs(row.share) >= _WORTH_A_ROW
    ]
    rows = [_printed_row(verdict, row) for row in shown]
    if verdict.unexplained is not None:
        rest = verdict.unexplained
        interval = percent_with_range(rest.share, unexplained_interval(rest))
        rows.append(("unexplained", interval, "", "", ""))
    blocks: list[Block] = [
        Table(EFFECTS_CAPTION, _PRINTED_COLUMNS, rows, main=("effect", _SHARE, "cause"))
    ]
    others = [effect_subject(effect.effect) for effect in verdict.effects if effect not in shown]
    if others:
        blocks.append(
            Paragraph(
                f"Each of these explains less than 1 % of the error: {join_words(others)}.",
                quiet=True,
            )
        )
    return blocks


_SHARE = "share (90 % interval)"
_PRINTED_COLUMNS = ("effect", _SHARE, ACTS, GAIN, "cause")


def _printed_row(verdict: Verdict, row: EffectSet | EffectShare) -> tuple[Cell, ...]:
    if isinstance(row, EffectSet):
        name = f"set {set_number(verdict, row)}: {set_name(row.effects)}"
    else:
        name = f"{row.effect}, {effect_subject(row.effect)}"
    return (
        name,
        percent_with_range(row.share, row.ci90)
        if math.isfinite(sum(row.ci90))
        else percent(row.share),
        percent(row.inclusion),
        percent(row.held_out_gain),
        cause_word(verdict, row),
    )


def _size(verdict: Verdict) -> Paragraph:
    gap = verdict.gap
    verb = "exceeds" if gap.beyond_noise else "lies within"
    families = join_words([f"{family.family} {times(family.excess)}" for family in gap.families])
    by_family = f" Above the noise, in tolerances: {families}." if len(gap.families) > 1 else ""
    return Paragraph(
        f"{gap.metric}: {number(gap.before)}; measurement noise {number(gap.noise_floor)}, "
        f"tolerance {number(gap.tolerance)}. The error {verb} both together.{by_family}",
        quiet=True,
    )


def _bar(cause: Cause) -> ShareBar:
    kind = "other" if cause.effects[0] in (NONE, UNKNOWN) else "named"
    value = percent(cause.probability)
    return ShareBar(
        cause_title(cause), value, 0.0, cause.probability, kind, lines=cause_lines(cause)
    )


def _pictures(verdict: Verdict, most: int | None) -> list[Block]:
    pictures = verdict.pictures
    if not (pictures.residuals or pictures.curves):
        return [Paragraph("No pictures are kept with this diagnosis.", quiet=True)]
    whole = pictures
    if most is not None:
        room = max(most - len(pictures.curves), 1)
        largest = sorted(pictures.residuals, key=_size_of_residual, reverse=True)[:room]
        kept = tuple(
            picture for picture in pictures.residuals if any(picture is item for item in largest)
        )
        pictures = replace(pictures, residuals=kept)
    figures = [residual_plot(p, pictures.configurations) for p in pictures.residuals]
    figures += [curve_plot(picture) for picture in pictures.curves]
    blocks: list[Block] = [ChartRow(figures)]
    if pictures.drawn_effects:
        blocks.append(Paragraph(drawn_effects_sentence(verdict), quiet=True))
    if pictures.residuals and pictures.configurations:
        names = "; ".join(
            f"{i}: {run_settings_words(name)}" for i, name in enumerate(pictures.configurations, 1)
        )
        blocks.append(Paragraph(f"The configurations of the residuals are {names}.", quiet=True))
    blocks += [
        Paragraph(f"Record: {run_settings_words(picture.title)}.", quiet=True)
        for picture in pictures.curves
        if "," in picture.title
    ]
    if hidden := len(whole.residuals) - len(pictures.residuals):
        blocks.append(
            Paragraph(
                f"{hidden} smaller residuals are drawn on the page of the diagnosis.", quiet=True
            )
        )
    return blocks


def run_settings_words(text: str) -> str:
    """Settings as a table of runs names them, in words: "bullet_mass_kg 0.4, tip_material steel"
    becomes "bullet mass 0.4 kg, tip material steel"."""
    words = []
    for part in text.split(", "):
        column, _, level = part.rpartition(" ")
        factor = BY_COLUMN.get(column)
        name = factor.name if factor else column
        unit = column.removeprefix(name).removeprefix("_") if factor else ""
        words.append(f"{name.replace('_', ' ')} {level} {unit}".strip())
    return ", ".join(words)


def _size_of_residual(picture: ResidualPicture) -> float:
    """The rms residual of the nominal model in tolerances; that of no number is the smallest."""
    finite_values = picture.before[np.isfinite(picture.before)]
    if not finite_values.size or not picture.tolerance > 0:
        return 0.0
    return float(np.sqrt(np.mean(finite_values**2)) / picture.tolerance)


def _unseen_figures(verdict: Verdict) -> list[Block]:
    """Before and after on configurations that the fit has not seen: a row for each figure, two
    columns for a test."""
    entries = verdict.shrinkage
    if not entries:
        return []
    values = [{_WHOLE: (entry.before, entry.after), **entry.more} for entry in entries]
    names = dict.fromkeys(name for row in values for name in row)
    labels = {name: _figure_label(name, verdict.gap.metric) for name in names}
    rows: list[list[Cell]] = [
        [labels[name], *(size for row in values for size in row.get(name, (None, None)))]
        for name in names
    ]
    tests = [entry.held_out_by.partition(":")[0] for entry in entries]
    columns = [f"{when}, {test}" for test in tests for when in ("before", "after")]
    return [Table(_UNSEEN, ("figure", *columns), rows, main=("figure", *columns[:2]))]


_UNSEEN = (
    "Error before and after. Configuration: each configuration in turn was left out of the fit. "
    "Corner: all configurations of a corner of the settings were left out."
)


_WHOLE = "error of all stages"
_STAGES = ("gun", "contact", "plate")
#: Figures of a diagnosis in words.
_FIGURES = {"ISO 18571 rating of the force": "ISO 18571 rating of the force (1 is best)"} | {
    stage_figure(stage): f"rms error of the {stage} (in tolerances)" for stage in _STAGES
}


def _figure_label(figure: str, metric: str) -> str:
    """A figure in words with its unit; the size of the gap has that of its metric."""
    if figure == _WHOLE:
        return metric
    if figure == CORRECTED:
        return f"{metric}, with a learned correction of the rest"
    if figure in [
        f"rms of {stage}" for stage in _STAGES
    ]:  # of an older version, which had it in the unit of the gap
        return f"{figure.replace('rms of', 'rms error of the')} alone, in the unit of the first row"
    return _FIGURES.get(figure, figure)


def diagnosis_document(session: Session, diagnosis_id: int) -> Document:
    """The report on a kept diagnosis. Raises `LookupError` for an unknown one."""
    report = kept_report(session, diagnosis_id)
    row = session.get_one(Diagnosis, diagnosis_id)
    verdict = kept_verdict(session, diagnosis_id) if row.details is not None else verdict_of(report)
    return document_of(
        verdict,
        f"{diagnosis_id}, of {row.diagnosed_at:%Y-%m-%d %H:%M} UTC",
        row.diagnosed_at.date(),
    )


def verdict_of(report: Mapping[str, Any]) -> Verdict:
    """The verdict of a report alone, without pictures and fits. Raises `ValueError` where a part is
    missing.

    A report of an older version does not say which effects are causes: those of the first entry
    are.
    """
    try:
        sets = report.get("sets") or report["causes"][:1]
        causes = [name for own in sets for name in single_effects(own["effects"])]
        details = {
            "format": FORMAT,
            "causes": [{} for _ in report["causes"]],
            "effects": [
                {"named": effect["effect"] in causes} for effect in report.get("effects", ())
            ],
        }
        return verdict_from_json(report, details)
    except (KeyError, TypeError) as error:
        raise ValueError(
            f"the kept diagnosis lacks {error}: diagnose again (pyroshock diagnose CAMPAIGN)"
        ) from error
