"""A diagnosis as one page that a person can read: whole in itself, no script, nothing fetched."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path

from ...diagnosis.verdict import NONE, UNKNOWN, Cause, Shrinkage, Verdict
from ...schema.outputs import write_text
from .charts import curve_chart, legend, residual_chart
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
from .style import STYLE

#: Causes from this probability on come with their equations.
_EXPLAINED = 0.05


def write_page(verdict: Verdict, path: Path) -> None:
    """Write the page to `path`, whose folder is made. Raises `OSError`."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, page(verdict))


def page(verdict: Verdict) -> str:
    """The page as HTML; every text from a campaign is escaped."""
    title = f"Diagnosis of {verdict.campaign}"
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{STYLE}</style></head>\n<body>\n"
        f"<header><h1>{escape(verdict_sentence(verdict))}</h1>"
        f'<p class="quiet">Simulator: {escape(verdict.simulator)}</p></header>\n'
        f"<main>{''.join(parts(verdict))}</main>\n"
        f"<footer><p>{escape(f'pyroshock diagnose, {number(verdict.seconds)} s')}</p></footer>\n</body></html>\n"
    )


def parts(verdict: Verdict) -> Iterator[str]:
    """The page's sections as HTML, for this page and the window's; every text is escaped."""
    yield _section("The gap, stage by stage", _waterfall(verdict))
    yield _section("Causes", _rows(_bar(cause) for cause in verdict.causes))
    yield _section("Where", _list(where_lines(verdict.where), "Nothing stands out."))
    yield _section("Residuals before and after", _residuals(verdict))
    yield _section("On configurations that it has not seen", _shrinkage(verdict.shrinkage))
    yield _section("The next experiment", _list(map(next_run_line, verdict.next_runs), "None is needed."))
    yield _section("Taken for granted", _list(verdict.assumptions, "Nothing beyond the campaign's own numbers."))


def _section(title: str, content: str) -> str:
    return f"<section><h2>{escape(title)}</h2>{content}</section>\n"


def _list(lines: Iterable[str], empty: str) -> str:
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<ul>{items}</ul>" if items else f'<p class="quiet">{escape(empty)}</p>'


def _rows(rows: Iterable[str]) -> str:
    return f'<div class="rows">{"".join(rows)}</div>'


def _row(name: str, value: str, start: float, end: float, kind: str, about: str = "") -> str:
    """A bar from `start` to `end`, shares of the track."""
    low, high = (100 * min(max(each, 0.0), 1.0) for each in (start, end))
    note = f'<span class="about quiet">{escape(about)}</span>' if about else ""
    return (
        f'<div class="row"><span>{escape(name)}</span><span class="value">{escape(value)}</span>'
        f'<span class="track"><i class="{kind}" style="left:{low:.1f}%;width:{high - low:.1f}%"></i></span>{note}</div>'
    )


def _bar(cause: Cause) -> str:
    kind = "other" if cause.effects[0] in (NONE, UNKNOWN) else "named"
    numbers = ", ".join(fitted_words(parameter) for parameter in cause.parameters)
    laws = _laws(cause) if cause.probability >= _EXPLAINED else ""
    about = "; ".join(filter(None, (numbers, laws)))
    return _row(cause_name(cause), percent(cause.probability), 0.0, cause.probability, kind, about)


def _laws(cause: Cause) -> str:
    """The equation of each effect once, however many members of the group have it."""
    return "; ".join(effect_title(each) for each in dict.fromkeys("+".join(cause.effects).split("+")))


@dataclass(frozen=True)
class Step:
    """One bar of the waterfall, from `start` to `end` in shares of the whole."""

    name: str
    value: str
    start: float
    end: float
    kind: str


def waterfall(verdict: Verdict) -> tuple[Step, ...]:
    """The squared gap (squares add up), less each stage's part of what is above the floor, down to the floor."""
    gap = verdict.gap
    whole = gap.before**2
    floor = min(gap.noise_floor**2 / whole, 1.0) if whole > 0 else 1.0
    steps = [Step("gap", number(gap.before), 0.0, 1.0, "other")]
    at = 1.0
    for stage in verdict.where.stage:
        part = stage.share * (1 - floor)
        steps.append(Step(stage.name, percent(stage.share), min(at, at - part), max(at, at - part), "named"))
        at -= part
    if verdict.where.stage and abs(at - floor) > 0.005:
        rest = (at - floor) / (1 - floor) if floor < 1 else 0.0
        steps.append(Step("not shared out", percent(rest), min(at, floor), max(at, floor), "other"))
    steps.append(Step("noise floor", number(gap.noise_floor), 0.0, floor, "floor"))
    low, high = min(step.start for step in steps), max(step.end for step in steps)
    whole = high - low
    return tuple(Step(s.name, s.value, (s.start - low) / whole, (s.end - low) / whole, s.kind) for s in steps)


def _waterfall(verdict: Verdict) -> str:
    gap = verdict.gap
    said = "beyond" if gap.beyond_noise else "within"
    told = (
        f"{gap.metric}: {number(gap.before)}, noise floor {number(gap.noise_floor)}, tolerance "
        f"{number(gap.tolerance)}; {said} both together. Bars are of the squared gap, whose parts add up."
    )
    rows = _rows(_row(s.name, s.value, s.start, s.end, s.kind) for s in waterfall(verdict))
    return f'{rows}<p class="quiet">{escape(told)}</p>'


def _residuals(verdict: Verdict) -> str:
    pictures = verdict.pictures
    if not (pictures.residuals or pictures.curves):
        return '<p class="quiet">No pictures were made.</p>'
    figures = [_figure(f"{p.name} ({p.stage})", residual_chart(p, pictures.configurations)) for p in pictures.residuals]
    figures += [_figure(picture.title, curve_chart(picture)) for picture in pictures.curves]
    names = "".join(f"<li>{escape(name)}</li>" for name in pictures.configurations)
    key = f"<details><summary>The configurations</summary><ol>{names}</ol></details>" if names else ""
    return f'<p>{legend(pictures)}</p><div class="charts">{"".join(figures)}</div>{key}'


def _figure(title: str, drawing: str) -> str:
    return f"<figure><h3>{escape(title)}</h3>{drawing}</figure>"


def _shrinkage(entries: Iterable[Shrinkage]) -> str:
    entries = tuple(entries)
    lines = _list(map(shrinkage_line, entries), "Not measured.")
    more = [(entry.held_out_by, entry.more) for entry in entries if entry.more]
    return lines + "".join(_table(held, figures) for held, figures in more)


def _table(held_out_by: str, figures: Mapping[str, tuple[float, float]]) -> str:
    head = "".join(f"<th>{escape(each)}</th>" for each in (f"held out by {held_out_by}", "before", "after"))
    body = "".join(
        f"<tr><td>{escape(name)}</td><td>{number(before)}</td><td>{number(after)}</td></tr>"
        for name, (before, after) in figures.items()
    )
    return f'<div class="scroll"><table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>'
