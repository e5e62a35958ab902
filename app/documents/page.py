"""A report as one web page, whole in itself: no script, nothing fetched, so that it opens from a
stick."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from .document import (
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
    cell_text,
    clean,
)
from .line_styles import STYLE, css

#: Of a page that is a file: it may ask for nothing, send nothing and run nothing, whatever it is
#: made to hold.
POLICY = "default-src 'none'; style-src 'unsafe-inline'; form-action 'none'; base-uri 'none'"


def html_of(document: Document) -> str:
    """The page; every text is escaped."""
    facts = "".join(
        f"<dt>{_text(name)}</dt><dd>{_text(value)}</dd>" for name, value in document.facts.items()
    )
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{_text(document.name)}</title><style>{STYLE}{css()}</style></head>\n<body>\n"
        f'<header><p class="kind">{_text(document.kind)}</p><h1>{_text(document.title)}</h1>'
        f"<p>{_text(document.lead)}</p><dl>{facts}</dl></header>\n"
        f"<main>{''.join(_section(section) for section in document.sections)}</main>\n"
        "<footer><p>pyroshock report</p></footer>\n</body></html>\n"
    )


def _text(text: str) -> str:
    return escape(clean(text))


def _section(section: Section) -> str:
    blocks = "".join(map(block_html, section.blocks))
    return f"<section><h2>{_text(section.title)}</h2>{blocks}</section>\n"


def block_html(block: Block) -> str:
    """One block of a section."""
    match block:
        case Paragraph():
            return f"<p{_QUIET if block.quiet else ''}>{_text(block.text)}</p>"
        case Bullets():
            items = "".join(f"<li>{_text(line)}</li>" for line in block.lines)
            return f"<ul>{items}</ul>" if items else f"<p{_QUIET}>{_text(block.empty)}</p>"
        case Table():
            return _table(block)
        case Bars():
            return f'<div class="rows">{"".join(map(_bar, block.bars))}</div>'
        case ChartRow():
            figures = "".join(map(_figure, block.figures))
            alone = " one" if len(block.figures) == 1 else ""
            return f'{_keys(block.keys)}<div class="charts{alone}">{figures}</div>'


_QUIET = ' class="quiet"'


def _table(table: Table) -> str:
    if not table.rows:
        return f"<p{_QUIET}>{_text(table.empty)}</p>"
    kinds = [_kind(table, i) for i in range(len(table.columns))]
    head = "".join(
        f'<th scope="col"{kind}>{_text(name)}</th>'
        for kind, name in zip(kinds, table.columns, strict=True)
    )
    body = "".join(f"<tr>{_cells(kinds, row)}</tr>\n" for row in table.rows)
    label = escape(clean(table.caption))
    whole = (
        f'<div class="scroll" role="region" tabindex="0" '
        f'aria-label="{label}"><table><caption>{label}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"
    )
    if not any("extra" in kind for kind in kinds):
        return whole
    return (
        f'<div class="fold">{whole}<label><input type="checkbox"> Show all '
        f"columns of this table</label></div>"
    )


def _kind(table: Table, column: int) -> str:
    """The classes of a column: numbers, and those that a telephone leaves out at first."""
    extra = bool(table.main) and table.columns[column] not in table.main
    names = [name for name, holds in (("num", table.is_number(column)), ("extra", extra)) if holds]
    return f' class="{" ".join(names)}"' if names else ""


def _cells(kinds: Sequence[str], row: Iterable[Cell]) -> str:
    return "".join(
        f"<td{kind}>{escape(cell_text(cell))}</td>" for kind, cell in zip(kinds, row, strict=True)
    )


def _bar(bar: ShareBar) -> str:
    low, high = (100 * min(max(edge, 0.0), 1.0) for edge in (bar.start, bar.end))
    note = f'<span class="about quiet">{_text(bar.about)}</span>' if bar.about else ""
    lines = "".join(f"<li>{_text(line)}</li>" for line in bar.lines)
    note += f'<ul class="about">{lines}</ul>' if lines else ""
    return (
        f'<div class="row"><span>{_text(bar.name)}</span><span '
        f'class="value">{_text(bar.value)}</span><span class="track"><i class="{escape(bar.kind)}" '
        f'style="left:{low:.1f}%;width:{high - low:.1f}%"></i></span>{note}</div>'
    )


def _figure(figure: Figure) -> str:
    drawing, keys = clean(figure.drawing), _keys(figure.keys)
    return f"<figure><h3>{_text(figure.title)}</h3>{drawing}{keys}</figure>"


def _keys(keys: Sequence[tuple[str, str]]) -> str:
    marks = "".join(
        f'<span class="key"><i class="key-{escape(k)}"></i>{_text(words)}</span>'
        for k, words in keys
    )
    return f'<p class="keys">{marks}</p>' if marks else ""
