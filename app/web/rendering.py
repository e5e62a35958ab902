"""Templates into answers. Everything that comes from the store or a person is escaped."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from datetime import date, datetime
from functools import cache, partial
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from ...schema.person_roles import ADMINISTRATOR
from ..common.number_format import finite, format_number
from ..common.quantities import cell, heading, in_shown_units
from ..figures.figure import Plot, PlotGrid
from ..figures.page_renderer import FigureData, figure_data
from .attachments_view import attachments_on, size_words
from .notes_view import notes_on
from .page_words import in_page_words
from .static_files import static_address

HERE = Path(__file__).parent


def number(value: float | None, digits: int = 4) -> str:
    """A number for a page, with a true minus sign."""
    return format_number(value, digits).replace("-", "−")


#: Address -> what the menu calls it.
MENU = {
    "/campaigns": "Campaigns",
    "/impacts": "Impacts",
    "/compare": "Compare",
    "/explore": "Explore",
    "/models": "Models",
    "/twin": "Twin",
    "/plans": "Plans",
    "/diagnoses": "Diagnoses",
    "/jobs": "Jobs",
}


def _figure_data(figure: Plot | PlotGrid | FigureData) -> Markup:
    """A figure, or the data that was made of it, for `static/charts.js`."""
    return as_data(figure_data(figure) if isinstance(figure, Plot | PlotGrid) else figure)


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(HERE / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "heading": heading,
        "number": number,
        "part": part,
        "data": as_data,
        "figure_data": _figure_data,
        "when": when,
        "page_words": in_page_words,
        "size": size_words,
    }
    environment.filters |= {"in_shown_units": in_shown_units, "filled": filled_columns}
    environment.globals |= {"notes_on": notes_on, "attachments_on": attachments_on}
    environment.globals |= {"cell": cell, "menu": MENU, "static": static_address}
    return environment


#: Pages that belong to an entry of the menu with another address.
_BELOW = {
    "/ingest": "/campaigns",
    "/deleted": "/campaigns",
    "/shots": "/impacts",
    "/spectra": "/compare",
    "/datasets": "/models",
    "/tune": "/twin",
    "/validations": "/twin",
}


def _section(path: str) -> str:
    """The address of the menu's entry that a page belongs to; empty for the first page and for the
    API."""
    return next(
        (_BELOW.get(start, start) for start in (*MENU, *_BELOW) if path.startswith(start)), ""
    )


def page(request: Request, template: str, status: int = 200, **values: Any) -> HTMLResponse:
    """A page. `request.state.csrf` is what its forms carry."""
    from ... import __version__

    text = (
        _environment()
        .get_template(template)
        .render(
            request=request,
            section=_section(request.url.path),
            csrf=request.state.csrf,
            version=__version__,
            mlflow=request.app.state.settings.mlflow,
            signed_in=request.app.state.sign_in.needed,
            **values,
        )
    )
    person, forms = request.state.person, request.app.state.form_roles
    if not person.may(ADMINISTRATOR):
        text = forms.marked(text, person, request.url.path)
    return HTMLResponse(text, status)


def filled_columns(rows: Sequence[Mapping[str, Any]], keys: Iterable[str]) -> list[str]:
    """The columns of a table that have a value in some row: the others would be dashes alone.

    Parameters:
        rows: The rows of the table.
        keys: Its columns in order.
    """
    return [key for key in keys if any(_is_value(row.get(key)) for row in rows)]


def _is_value(cell_value: object) -> bool:
    return cell_value not in (None, "") and cell_value == cell_value  # NaN differs from itself


def named_file(content: bytes, name: str, ending: str, media_type: str) -> Response:
    """A page that opens; any other form is saved under its name."""
    shown = "inline" if ending == "html" else "attachment"
    disposition = f"{shown}; filename*=UTF-8''{part(name)}.{ending}"
    return Response(content, media_type=media_type, headers={"content-disposition": disposition})


def part(name: object) -> str:
    """A name as one part of an address, slashes included."""
    return quote(str(name), safe="")


def as_data(value: Any) -> Markup:
    """JSON within a script element: nothing in it can end the element."""
    write = partial(json.dumps, allow_nan=False, separators=(",", ":"), default=str)
    try:
        text = write(value)  # a chart has no gaps as a rule: its numbers are gone through once
    except ValueError:  # there is a gap: NaN, which JSON does not have
        text = write(finite(value))
    # so escaped
    return Markup(text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e"))  # noqa: S704


def when(value: datetime | date | str | None) -> str:
    """A time to the minute, a date as it is."""
    if value is None:
        return "–"
    if isinstance(value, datetime):
        return f"{value:%Y-%m-%d %H:%M}"
    return str(value)[:16].replace("T", " ")


def query(values: Mapping[str, Any]) -> str:
    """`?a=b&c=d` of what is given; empty values are left out."""
    given = [
        (key, v)
        for key, value in values.items()
        for v in (value if isinstance(value, list) else [value])
        if v
    ]
    return f"?{urlencode(given)}" if given else ""
