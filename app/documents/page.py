"""A report as one web page, whole in itself: no script, nothing fetched, so that it opens from a
stick. `pdf` prints the same page."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup, escape

from ..figures.figure import ColourRole
from ..figures.inline_svg import inline_svg
from ..figures.palette import CARD, Scheme, colour_of
from .charts import legends_of
from .document import Block, Document, ShareBar, Table, cell_text, clean

#: Of a page that is a file: it may ask for nothing, send nothing and run nothing, whatever it is
#: made to hold.
POLICY = (
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; form-action 'none'; "
    "base-uri 'none'"
)
_TEMPLATES = Path(__file__).with_name("templates")
#: Letters of a cell that stays on one line, of a word that a narrow column may break, and of the
#: pieces that it is broken into.
_ONE_LINE, _LONG_WORD, _PIECE = 16, 28, 20


def html_of(document: Document) -> str:
    """The page; every text is escaped."""
    return render(document, stylesheet("page.css"))


def render(document: Document, style: str, remarks: Sequence[str] = ()) -> str:
    """The page in a style, with `remarks` at its end."""
    template = _environment().get_template("document.html")
    return template.render(document=document, style=style, remarks=remarks, policy=POLICY)


def blocks_html(blocks: Sequence[Block]) -> str:
    """The blocks of a section within another page, whose style holds `section_style`."""
    return str(_environment().get_template("blocks.html").module.every(blocks))  # type: ignore[attr-defined]


@cache
def stylesheet(*names: str) -> str:
    """The style of a whole page: colours, the parts of reports, and the files of these names."""
    return _colours() + "".join(map(_css, ("parts.css", *names)))


def section_style() -> str:
    """The style of sections that stand in another page, within its elements of class "report"."""
    return f"{_colours()}.report {{\n{_css('parts.css')}}}\n"


def _css(name: str) -> str:
    return (_TEMPLATES / name).read_text(encoding="utf-8")


def _colours() -> str:
    """The colours of all roles as custom properties; those of the light scheme on paper."""
    light, dark = _properties("light"), _properties("dark")
    return (
        f":root {{ color-scheme: light dark; {light} }}\n"
        f"@media screen and (prefers-color-scheme: dark) {{ :root {{ {dark} }} }}\n"
    )


def _properties(scheme: Scheme) -> str:
    roles = {role.value: colour_of(role, scheme) for role in ColourRole}
    return " ".join(
        f"--{name}: {colour};" for name, colour in {**roles, "card": CARD[scheme]}.items()
    )


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_cleaned,
    )
    environment.filters |= {
        "block_kind": lambda block: type(block).__name__.lower(),
        "cell_text": cell_text,
        "column_classes": _column_classes,
        "cell_class": _cell_class,
        "breakable": _breakable,
        "bar_place": _bar_place,
        "chart": lambda plot: Markup(inline_svg(plot)),  # noqa: S704  # escaped by its renderer
        "legends": legends_of,
        "in_page": _in_page,
    }
    return environment


def _in_page(jpeg: bytes) -> Markup:
    """The address of a picture that is its content (RFC 2397)."""
    return Markup("data:image/jpeg;base64,") + base64.b64encode(jpeg).decode()


def _cleaned(value: Any) -> Any:
    return type(value)(clean(value)) if isinstance(value, str) else value


def _column_classes(table: Table) -> list[str]:
    """The classes of each column: numbers, and those that a telephone leaves out at first."""
    return [
        " ".join(
            name
            for name, holds in (
                ("num", table.is_number(i)),
                ("extra", bool(table.main) and column not in table.main),
            )
            if holds
        )
        for i, column in enumerate(table.columns)
    ]


def _cell_class(words: str) -> str:
    """The class of a cell that stays on one line: a date with its time, a number with its unit."""
    return " short" if len(words) <= _ONE_LINE else ""


def _breakable(words: str) -> Markup:
    """`words` with places where a narrow column may break its long ones."""
    return Markup(" ").join(
        Markup("<wbr>").join(word[i : i + _PIECE] for i in range(0, len(word), _PIECE))
        if len(word) > _LONG_WORD
        else escape(word)
        for word in words.split(" ")
    )


def _bar_place(bar: ShareBar) -> str:
    low, high = (100 * min(max(edge, 0.0), 1.0) for edge in (bar.start, bar.end))
    return f"left:{low:.1f}%;width:{high - low:.1f}%"
