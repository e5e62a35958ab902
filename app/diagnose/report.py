"""A diagnosis as a report: sections that the terminal, the page of `diagnose --html`, the web application and the PDF
share. A kept diagnosis comes with all that its page draws, one of an older store with the numbers alone."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from sqlalchemy.orm import Session

from ...diagnosis.verdict import NONE, UNKNOWN, Cause, EffectShare, Pictures, Shrinkage, Verdict
from ...schema.atomic_write import write_text
from ...schema.diagnoses import Diagnosis
from ..common.number_format import number, percent, percent_range
from ..documents.document import (
    Bars,
    Block,
    Bullets,
    Cell,
    ChartRow,
    Document,
    Figure,
    Paragraph,
    Section,
    ShareBar,
    Table,
)
from ..documents.page import block_html, html_of
from .recommendations import next_experiment, recommendations
from .report_charts import curve_chart, legend_keys, path_chart, residual_chart, residual_title, share_chart
from .request import restrictions_among
from .stored import FORMAT, kept_report, kept_verdict, verdict_from_json
from .summary import summary
from .wording import cause_name, effect_subject, effect_title, fitted_words, shrinkage_line, single_effects, where_lines

#: Causes from this probability on come with their equations.
_EXPLAINED = 0.05
#: The section whose table the web application shows with boxes to tick, and those before it.
EFFECTS = "Effects"
FIRST_SECTIONS = ("What to do next", "How far the error shrinks, and what causes it")


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
        sections=sections(verdict),
        date=date,
    )


def sentence_sections(verdict: Verdict) -> dict[str, tuple[str, ...]]:
    """The sentences of each section that is made of sentences alone, by title."""
    return {
        FIRST_SECTIONS[0]: recommendations(verdict),
        "Where the error lies": tuple(where_lines(verdict.where)),
        "On configurations that the fit has not seen": tuple(map(shrinkage_line, verdict.shrinkage)),
        "The next experiment": next_experiment(verdict),
        "Assumptions": verdict.assumptions,
    }


def sections(verdict: Verdict) -> tuple[Section, ...]:
    """All of the report but its title; sections without anything to show are left out."""
    sentences = sentence_sections(verdict)

    def listed(title: str, empty: str, *further: Block) -> Section:
        return Section(title, [Bullets(sentences[title], empty), *further])

    every = (
        Section(FIRST_SECTIONS[0], [Paragraph(" ".join(sentences[FIRST_SECTIONS[0]]))]),
        Section(FIRST_SECTIONS[1], _path_and_shares(verdict)),
        Section(EFFECTS, _effects(verdict)),
        Section("Causes", [Bars([_bar(cause) for cause in verdict.causes])]),
        Section("The model error, stage by stage", _gap(verdict)),
        listed("Where the error lies", "No place stands out."),
        Section("Residuals before and after", _pictures(verdict.pictures)),
        listed("On configurations that the fit has not seen", "Not measured.", *_further_figures(verdict.shrinkage)),
        listed("The next experiment", "None."),
        listed("Assumptions", "None beyond the campaign's own numbers."),
    )
    return tuple(section for section in every if section.blocks)


def section_html(section: Section) -> str:
    """The blocks of a section as HTML, every text escaped."""
    return "".join(map(block_html, section.blocks))


def _path_and_shares(verdict: Verdict) -> list[Block]:
    charts = {"The path of the model error": path_chart(verdict), "Shares of the effects": share_chart(verdict)}
    figures = [Figure(title, drawing) for title, drawing in charts.items() if drawing]
    if not figures:
        return []
    return [
        ChartRow(figures),
        Paragraph(
            "The path adds one effect after the other and measures the error on configurations that the fit has not "
            "seen. Shares are of the squared error of all configurations; blue effects are established as causes.",
            quiet=True,
        ),
    ]


#: Headings of the table of effects.
EFFECT_COLUMNS = (
    "effect", "name", "share", "90 % interval", "probability", "held out", "set", "cause", "parameters"
)  # fmt: skip


def effect_rows(verdict: Verdict) -> list[tuple[Cell, ...]]:
    """A row for each effect under `EFFECT_COLUMNS`, and a last one for what is unexplained."""
    rows = [_effect_row(effect) for effect in verdict.effects]
    if verdict.unexplained is not None:
        rest = verdict.unexplained
        rows.append(("unexplained", "", percent(rest.share), percent_range(*rest.ci90), "", "", "", "", ""))
    return rows


def _effect_row(effect: EffectShare) -> tuple[Cell, ...]:
    return (
        effect.effect,
        effect_subject(effect.effect),
        percent(effect.share),
        percent_range(*effect.ci90),
        percent(effect.inclusion),
        percent(effect.held_out_gain),
        effect.credible_set,
        "yes" if effect.named else "no",
        ", ".join(map(fitted_words, effect.parameters)),
    )


EFFECTS_CAPTION = (
    "Share of the squared error with its 90 % interval, probability that the effect acts, and what it takes away on "
    "configurations that it was not fitted to (held out). Of the effects of one set at least one acts, but the data "
    "cannot say which."
)


def _effects(verdict: Verdict) -> list[Block]:
    if not verdict.effects:
        return []
    rows = [[_unbroken(cell) for cell in row] for row in effect_rows(verdict)]
    return [Table(EFFECTS_CAPTION, EFFECT_COLUMNS, rows)]


def _unbroken(cell: Cell) -> Cell:
    """Per cent on the line of its number."""
    return cell.replace(" %", "\u00a0%") if isinstance(cell, str) else cell


def waterfall(verdict: Verdict) -> tuple[ShareBar, ...]:
    """The squared gap (squares add up), less each stage's part of what is above the floor, down to the floor."""
    gap = verdict.gap
    whole = gap.before**2
    floor = min(gap.noise_floor**2 / whole, 1.0) if whole > 0 else 1.0
    bars = [ShareBar("model error", number(gap.before), 0.0, 1.0, "other")]
    level = 1.0
    for stage in verdict.where.stage:
        part = stage.share * (1 - floor)
        bars.append(
            ShareBar(stage.name, percent(stage.share), min(level, level - part), max(level, level - part), "named")
        )
        level -= part
    if verdict.where.stage and abs(level - floor) > 0.005:
        rest = (level - floor) / (1 - floor) if floor < 1 else 0.0
        bars.append(ShareBar("of no single stage", percent(rest), min(level, floor), max(level, floor), "other"))
    bars.append(ShareBar("measurement noise", number(gap.noise_floor), 0.0, floor, "floor"))
    low, high = min(bar.start for bar in bars), max(bar.end for bar in bars)
    return tuple(
        replace(bar, start=(bar.start - low) / (high - low), end=(bar.end - low) / (high - low)) for bar in bars
    )


def _gap(verdict: Verdict) -> list[Block]:
    gap = verdict.gap
    verb = "exceeds" if gap.beyond_noise else "lies within"
    size = (
        f"{gap.metric}: {number(gap.before)}; measurement noise {number(gap.noise_floor)}, tolerance "
        f"{number(gap.tolerance)}. The error {verb} both together. Bars are of the squared error, whose parts add up."
    )
    if not math.isfinite(gap.before + gap.noise_floor):
        return [Paragraph(size)]
    return [Bars(list(waterfall(verdict))), Paragraph(size, quiet=True)]


def _bar(cause: Cause) -> ShareBar:
    kind = "other" if cause.effects[0] in (NONE, UNKNOWN) else "named"
    explained = cause.effects if cause.probability >= _EXPLAINED else ()
    laws = map(effect_title, single_effects(explained))
    about = "; ".join(filter(None, (", ".join(map(fitted_words, cause.parameters)), *laws)))
    return ShareBar(cause_name(cause), percent(cause.probability), 0.0, cause.probability, kind, about)


def _pictures(pictures: Pictures) -> list[Block]:
    if not (pictures.residuals or pictures.curves):
        return [Paragraph("No pictures are kept with this diagnosis.", quiet=True)]
    figures = [Figure(residual_title(p), residual_chart(p, pictures.configurations)) for p in pictures.residuals]
    figures += [Figure(picture.title, curve_chart(picture)) for picture in pictures.curves]
    blocks: list[Block] = [ChartRow(figures, legend_keys(pictures))]
    if pictures.residuals and pictures.configurations:
        rows: list[list[Cell]] = [[i, name] for i, name in enumerate(pictures.configurations, 1)]
        blocks.append(Table("The configurations of the residuals.", ("configuration", "settings"), rows))
    return blocks


def _further_figures(entries: Sequence[Shrinkage]) -> Iterator[Block]:
    for entry in entries:
        rows: list[list[Cell]] = [[name, before, after] for name, (before, after) in entry.more.items()]
        if rows:
            yield Table(f"Held out by {entry.held_out_by}.", ("figure", "before", "after"), rows)


def diagnosis_document(session: Session, diagnosis_id: int) -> Document:
    """The report on a kept diagnosis. Raises `LookupError` for an unknown one."""
    report = kept_report(session, diagnosis_id)
    row = session.get_one(Diagnosis, diagnosis_id)
    verdict = kept_verdict(session, diagnosis_id) if row.details is not None else verdict_of(report)
    return document_of(verdict, f"{diagnosis_id}, of {row.diagnosed_at:%Y-%m-%d %H:%M} UTC", row.diagnosed_at.date())


def verdict_of(report: Mapping[str, Any]) -> Verdict:
    """The verdict of a report alone, without pictures and fits. Raises `ValueError` where a part is missing.

    A report alone does not say which effects are causes: those of the first entry are.
    """
    try:
        causes = [name for cause in report["causes"][:1] for name in single_effects(cause["effects"])]
        details = {
            "format": FORMAT,
            "causes": [{} for _ in report["causes"]],
            "effects": [{"named": effect["effect"] in causes} for effect in report.get("effects", ())],
        }
        return verdict_from_json(report, details)
    except (KeyError, TypeError) as error:
        raise ValueError(f"the kept diagnosis lacks {error}: diagnose again (pyroshock diagnose CAMPAIGN)") from error
