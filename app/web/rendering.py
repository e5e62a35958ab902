"""Templates into answers, and how a column of plain rows (SI, unit in the key) is headed and scaled for a person.
Everything that comes from the store or a person is escaped."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import date, datetime
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote, urlencode

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

from ..common.number_format import finite

#: Key -> (heading with its unit, shown units per SI unit). Of keys that are not here the words and unit are the key's.
HEADINGS: dict[str, tuple[str, float]] = {
    "tip_radius": ("tip radius (mm)", 1e3),
    "tip_radius_m": ("tip radius (mm)", 1e3),
    "bullet_mass": ("bullet mass (kg)", 1.0),
    "tank_pressure": ("tank pressure (bar)", 1e-5),
    "tank_pressure_pa": ("tank pressure (bar)", 1e-5),
    "bullet_mass_kg": ("bullet mass (kg)", 1.0),
    "impact_velocity_m_s": ("impact velocity (m/s)", 1.0),
    "impact_velocity_u_m_s": ("its uncertainty (m/s)", 1.0),
    "measured_velocity_m_s": ("measured velocity (m/s)", 1.0),
    "measured_velocity_u_m_s": ("its uncertainty (m/s)", 1.0),
    "predicted_velocity_m_s": ("model's velocity (m/s)", 1.0),
    "velocity_m_s": ("impact velocity (m/s)", 1.0),
    "contact_time_s": ("contact time (ms)", 1e3),
    "compression_time_s": ("compression time (ms)", 1e3),
    "width_half_s": ("width at half (ms)", 1e3),
    "start_s": ("start (ms)", 1e3),
    "peak_force_n": ("peak force (kN)", 1e-3),
    "spline_peak_force_n": ("spline's peak (kN)", 1e-3),
    "impulse_n_s": ("impulse (N s)", 1.0),
    "sampling_rate_hz": ("sampling rate (kHz)", 1e-3),
    "mean_peak_n": ("mean peak (kN)", 1e-3),
    "deviation_n": ("its deviation (kN)", 1e-3),
    "deviation_s": ("its deviation (ms)", 1e3),
    "peak_acceleration_m_s2": ("peak acceleration (m/s²)", 1.0),
    "pulse_duration_s": ("pulse duration (ms)", 1e3),
    "pulse_start_s": ("pulse start (ms)", 1e3),
    "peak_time_s": ("time of peak (ms)", 1e3),
    "effective_duration_s": ("effective duration (ms)", 1e3),
    "energy_duration_s": ("energy duration (ms)", 1e3),
    "worst_frequency_hz": ("at (Hz)", 1.0),
    "worst_margin_db": ("worst margin (dB)", 1.0),
}
_UNITS = (("_m_s2", "m/s²"), ("_m_s", "m/s"), ("_n_s", "N s"), ("_hz", "Hz"), ("_db", "dB"), ("_kg", "kg"),
          ("_pa", "Pa"), ("_s", "s"), ("_n", "N"), ("_m", "m"))  # fmt: skip


def heading(key: str) -> str:
    """`contact_time_s` -> "contact time (ms)"."""
    if key in HEADINGS:
        return HEADINGS[key][0]
    for ending, unit in _UNITS:
        if key.endswith(ending) and len(key) > len(ending):
            return f"{key.removesuffix(ending).replace('_', ' ')} ({unit})"
    return key.replace("_", " ")


def cell(key: str, value: Any) -> str:
    """A value under its heading: four digits are more than any of our measurements holds."""
    if value is None or value == "":
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return number(value * HEADINGS.get(key, ("", 1.0))[1])
    return str(value)


def number(value: float | None, digits: int = 4) -> str:
    """A number for a person, a true minus included."""
    if value is None or value != value:
        return "–"
    return f"{value:.{digits}g}".replace("-", "−")


HERE = Path(__file__).parent

#: Address -> what the menu calls it.
MENU = {
    "/campaigns": "Campaigns",
    "/impacts": "Impacts",
    "/compare": "Compare",
    "/models": "Models",
    "/twin": "Twin",
    "/plans": "Plans",
    "/diagnoses": "Diagnoses",
    "/jobs": "Jobs",
}


@cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(HERE / "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"heading": heading, "number": number, "part": part, "data": as_data, "when": when}
    environment.globals |= {"cell": cell, "menu": MENU}
    return environment


def page(request: Request, template: str, status: int = 200, **values: Any) -> HTMLResponse:
    """A page. `request.state.csrf` is what its forms carry."""
    from ... import __version__

    text = (
        _environment()
        .get_template(template)
        .render(
            request=request,
            path=request.url.path,
            csrf=request.state.csrf,
            version=__version__,
            mlflow=request.app.state.settings.mlflow,
            **values,
        )
    )
    return HTMLResponse(text, status)


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
    text = json.dumps(finite(value), allow_nan=False, separators=(",", ":"), default=str)
    return Markup(text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e"))  # noqa: S704  # so escaped


def when(value: datetime | date | str | None) -> str:
    """A time to the minute, a date as it is."""
    if value is None:
        return "–"
    if isinstance(value, datetime):
        return f"{value:%Y-%m-%d %H:%M}"
    return str(value)[:16].replace("T", " ")


def query(values: Mapping[str, Any]) -> str:
    """`?a=b&c=d` of what is given; empty values are left out."""
    given = [(key, v) for key, value in values.items() for v in (value if isinstance(value, list) else [value]) if v]
    return f"?{urlencode(given)}" if given else ""
