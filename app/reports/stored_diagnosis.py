"""A kept diagnosis as a report: with all that its page draws, or of an older store the numbers alone."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from sqlalchemy.orm import Session

from ...diagnosis.kept import FORMAT, verdict_from_json
from ...diagnosis.pictures import Pictures
from ...diagnosis.verdict import NONE, UNKNOWN, Cause, Shrinkage, Verdict
from ...schema.diagnoses import Diagnosis
from ..diagnoses.kept import kept_report, kept_verdict
from .charts import curve_chart, legend_keys, residual_chart
from .diagnosis import waterfall
from .document import Bar, Bars, Block, Bullets, Cell, Document, Figure, Figures, Paragraph, Section, Table
from .sentences import (
    cause_name,
    effect_title,
    fitted_words,
    next_run_line,
    number,
    percent,
    shrinkage_line,
    verdict_sentence,
    where_lines,
)

#: Of a report, where null says that there is none; elsewhere it is a number that JSON has not.
_MAY_BE_NONE = ("fraction", "ci90", "credible_set", "unexplained")
#: Causes from this probability on come with their equations.
_EXPLAINED = 0.05


def diagnosis_document(session: Session, diagnosis_id: int) -> Document:
    """The report on a kept diagnosis. Raises `LookupError` for an unknown one."""
    report = kept_report(session, diagnosis_id)
    row = session.get_one(Diagnosis, diagnosis_id)
    verdict = kept_verdict(session, diagnosis_id) if row.details is not None else verdict_of(report)
    return document_of(verdict, f"{diagnosis_id}, of {row.diagnosed_at:%Y-%m-%d %H:%M} UTC", row.diagnosed_at.date())


def verdict_of(report: Mapping[str, Any]) -> Verdict:
    """The verdict of a report alone, without pictures and fits. Raises `ValueError` where a part is missing."""
    try:
        causes = [{"split": cause.get("split", []), "fitted": []} for cause in report["causes"]]
        pictures: dict[str, list[Any]] = {"configurations": [], "residuals": [], "curves": []}
        lost = [{"at": at, "value": "nan"} for at in _nulls(report, [])]
        effects = [{"named": effect["effect"] in _named(report)} for effect in report.get("effects", ())]
        details = {
            "format": FORMAT,
            "lost": lost,
            "causes": causes,
            "effects": effects,
            "fits": {},
            "pictures": pictures,
        }
        return verdict_from_json(report, details)
    except (KeyError, TypeError) as error:
        raise ValueError(f"the kept diagnosis lacks {error}: diagnose again (pyroshock diagnose CAMPAIGN)") from error


def _named(report: Mapping[str, Any]) -> set[str]:
    """The effects of the first entry: a report alone does not say what else was named."""
    return set("+".join(report["causes"][0]["effects"]).split("+"))


def _nulls(value: Any, at: Sequence[str | int]) -> Iterator[list[str | int]]:
    if isinstance(value, Mapping):
        for key, each in value.items():
            if each is not None or key not in _MAY_BE_NONE or at[:1] == ["path"]:
                yield from _nulls(each, [*at, key])
    elif isinstance(value, list):
        for i, each in enumerate(value):
            yield from _nulls(each, [*at, i])
    elif value is None:
        yield list(at)


def document_of(verdict: Verdict, name: str, date: dt.date | None) -> Document:
    """The report on a verdict, kept under `name`."""
    return Document(
        kind="Diagnosis",
        title=verdict.campaign,
        lead=verdict_sentence(verdict),
        facts={"Diagnosis": name, "Simulator": verdict.simulator},
        sections=(
            Section("The gap, stage by stage", _gap(verdict)),
            Section("Causes", [Bars([_bar(cause) for cause in verdict.causes])]),
            Section("Where", [Bullets(list(where_lines(verdict.where)), "Nothing stands out.")]),
            Section("Residuals before and after", _pictures(verdict.pictures)),
            Section("On configurations that it has not seen", _shrinkage(verdict.shrinkage)),
            Section("The next experiment", [Bullets(list(map(next_run_line, verdict.next_runs)), "None is needed.")]),
            Section("Taken for granted", [Bullets(verdict.assumptions, "Nothing beyond the campaign's own numbers.")]),
        ),
        date=date,
    )


def _gap(verdict: Verdict) -> list[Block]:
    gap = verdict.gap
    said = "beyond" if gap.beyond_noise else "within"
    told = (
        f"{gap.metric}: {number(gap.before)}, noise floor {number(gap.noise_floor)}, tolerance "
        f"{number(gap.tolerance)}; {said} both together. Bars are of the squared gap, whose parts add up."
    )
    if not math.isfinite(gap.before + gap.noise_floor):
        return [Paragraph(told)]
    bars = Bars([Bar(step.name, step.value, step.start, step.end, step.kind) for step in waterfall(verdict)])
    return [bars, Paragraph(told, quiet=True)]


def _bar(cause: Cause) -> Bar:
    kind = "other" if cause.effects[0] in (NONE, UNKNOWN) else "named"
    explained = cause.effects if cause.probability >= _EXPLAINED else ()
    laws = (effect_title(each) for each in dict.fromkeys("+".join(explained).split("+")))
    about = "; ".join(filter(None, (", ".join(map(fitted_words, cause.parameters)), *laws)))
    return Bar(cause_name(cause), percent(cause.probability), 0.0, cause.probability, kind, about)


def _pictures(pictures: Pictures) -> list[Block]:
    if not (pictures.residuals or pictures.curves):
        return [Paragraph("No pictures are kept with this diagnosis.", quiet=True)]
    figures = [Figure(f"{p.name} ({p.stage})", residual_chart(p, pictures.configurations)) for p in pictures.residuals]
    figures += [Figure(picture.title, curve_chart(picture)) for picture in pictures.curves]
    blocks: list[Block] = [Figures(figures, legend_keys(pictures))]
    if pictures.residuals and pictures.configurations:
        rows: list[list[Cell]] = [[i, name] for i, name in enumerate(pictures.configurations, 1)]
        blocks.append(Table("The configurations of the residuals.", ("configuration", "settings"), rows))
    return blocks


def _shrinkage(entries: Sequence[Shrinkage]) -> list[Block]:
    blocks: list[Block] = [Bullets(list(map(shrinkage_line, entries)), "Not measured.")]
    for entry in entries:
        rows: list[list[Cell]] = [[name, before, after] for name, (before, after) in entry.more.items()]
        if rows:
            blocks.append(Table(f"Held out by {entry.held_out_by}.", ("figure", "before", "after"), rows))
    return blocks
