"""The units in which people read quantities: bar, g, kN, ms, mm and m/s, or SI where `--units si`
asks for it.

Rows of data name their quantities with the SI unit in the key (`peak_force_n`). Tables, pages and
reports take label, unit and scale of a key from here; JSON and files stay in SI.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

from ...schema.known_factors import NONE
from ...schema.velocity_kinds import BEFORE_CONTACT, INTEGRATED, TARGET_MOTION_ADDED
from .number_format import NOTHING, format_number, measured_text
from .unit_endings import UNIT_ENDINGS, unit_ending

#: "bench": the units of the field. "si": SI.
System = Literal["bench", "si"]
SYSTEMS: tuple[System, ...] = ("bench", "si")
#: Sets the units where no option does.
VARIABLE = "PYROSHOCK_UNITS"


@dataclass(frozen=True)
class Display:
    """What a key of data is called, and the unit that it is shown in: shown value = `scale` times
    the value.

    Values are SI, or in the unit of the field that the key names (`tip_radius_mm`).
    """

    label: str
    unit: str
    scale: float

    @property
    def heading(self) -> str:
        """`contact time (ms)`; without brackets where there is no unit."""
        return f"{self.label} ({self.unit})" if self.unit else self.label


#: Endings of columns of plans and of `runs.csv`, which are in units of the field: unit, SI unit,
#: and its factor.
_FIELD_UNITS: tuple[tuple[str, str, str, float], ...] = (
    ("_bar", "bar", "Pa", 1e5),
    ("_mm", "mm", "m", 1e-3),
    ("_ms", "ms", "s", 1e-3),
)
#: Keys whose label or unit does not follow from their words.
_LABELS = {
    "id": "impact",
    "impact_velocity_u_m_s": "uncertainty of the velocity",
    "measured_velocity_u_m_s": "uncertainty of the velocity",
    "predicted_velocity_m_s": "velocity of the model",
    "expected_velocity_m_s": "velocity predicted before the shot",
    "velocity_rank": "rank of the velocity among the predicted ones",
    "velocity_m_s": "impact velocity",
    "width_half_s": "width at half of the peak",
    "spline_peak_force_n": "peak of the spline",
    "srs_peak_m_s2": "SRS peak",
    "srs_peak_frequency_hz": "frequency of the SRS peak",
    "mean_peak_n": "mean peak",
    "deviation_n": "standard deviation",
    "deviation_s": "standard deviation",
    "peak_time_s": "time of the peak",
    "worst_frequency_hz": "worst frequency",
    "duration_10_90_s": "duration from 10 to 90 %",
    "duration_5_95_s": "duration from 5 to 95 %",
    "rms_duration_s": "rms duration",
    "q": "Q",
    "force_rmse_n": "force RMSE",
    "force_nrmse": "force NRMSE",
    "centroid_s": "centroid in time",
    "cost": "cost, elements per thousand that miss the pulse",
}
#: Of materials, also of tip and plate: by the end of the key.
_MATERIAL_UNITS = {"youngs_modulus_pa": ("GPa", 1e-9), "yield_strength_pa": ("MPa", 1e-6)}
#: Keys whose unit on the bench is another one than that of their ending.
_OTHER_UNITS = {
    "sampling_rate_hz": ("kHz", 1e-3),
    "seconds": ("s", 1.0),
    "duration_s": ("s", 1.0),
}
#: Factors that stand without a unit in their key.
_FACTORS = {
    "tip_radius": "tip_radius_m",
    "bullet_mass": "bullet_mass_kg",
    "tank_pressure": "tank_pressure_pa",
}


#: Keys of the velocity that an impact is stored with, whose heading says how it was obtained.
_OF_IMPACTS = ("impact_velocity_m_s", "impact_velocity")
_VELOCITIES = {
    BEFORE_CONTACT: "impact velocity",
    INTEGRATED: "velocity change of the impactor by integration",
    TARGET_MOTION_ADDED: "impact velocity by integration, with the target's motion",
}

_chosen: ContextVar[System | None] = ContextVar("units", default=None)
_velocity: ContextVar[str] = ContextVar("velocity", default=_VELOCITIES[BEFORE_CONTACT])


def units() -> System:
    """The units that are in use: those of `shown_in`, else those that PYROSHOCK_UNITS names, else
    the field's.

    Raises `ValueError` where the variable has another word.
    """
    return _chosen.get() or _named(os.environ.get(VARIABLE) or "bench")


@contextmanager
def shown_in(system: System) -> Iterator[None]:
    """Show quantities in these units within the block."""
    token = _chosen.set(system)
    try:
        yield
    finally:
        _chosen.reset(token)


def _named(text: str) -> System:
    for system in SYSTEMS:
        if text == system:
            return system
    raise ValueError(f"{VARIABLE} is {text!r}; expected one of {', '.join(SYSTEMS)}")


def display_of(key: str) -> Display:
    """What a key of data is called and shown in: `contact_time_s` is the contact time in ms, in SI
    in s."""
    display = _display_of(key, units())
    return replace(display, label=_velocity.get()) if key in _OF_IMPACTS else display


def velocity_label(kinds: Iterable[str | None]) -> str:
    """What velocities of these kinds (`schema.impacts.KINDS`) are called. One that was integrated
    from first contact to the peak of the force is a change of velocity: the target moves by then,
    so that it is some way below the velocity before contact."""
    present = {kind for kind in kinds if kind is not None}
    if len(present) > 1:
        return "velocity: before contact or change by integration (see velocity kind)"
    return _VELOCITIES.get(next(iter(present), BEFORE_CONTACT), _VELOCITIES[BEFORE_CONTACT])


@contextmanager
def velocities_of(rows: Iterable[Mapping[str, Any]]) -> Iterator[None]:
    """Within the block, head the velocities of impacts by what these rows say of them
    (`velocity_kind`)."""
    kinds = (row.get("velocity_kind") for row in rows if row.get("impact_velocity_m_s") is not None)
    token = _velocity.set(velocity_label(kinds))
    try:
        yield
    finally:
        _velocity.reset(token)


@cache
def _display_of(key: str, system: System) -> Display:
    key = _FACTORS.get(key, key)
    entry = unit_ending(key)
    if entry is not None and entry.shown:
        label = _LABELS.get(key) or _spelled(key.removesuffix(entry.ending))
        if system == "si":
            return Display(label, entry.unit, 1.0)
        of_material = next(
            (shown for end, shown in _MATERIAL_UNITS.items() if key.endswith(end)),
            (entry.shown, entry.scale),
        )
        return Display(label, *_OTHER_UNITS.get(key, of_material))
    for ending, unit, si_unit, si_scale in _FIELD_UNITS:
        if key.endswith(ending) and len(key) > len(ending):
            label = _spelled(key.removesuffix(ending))
            return (
                Display(label, si_unit, si_scale) if system == "si" else Display(label, unit, 1.0)
            )
    return Display(_LABELS.get(key) or _spelled(key), "", 1.0)


def _spelled(name: str) -> str:
    return name.replace("_", " ").replace("youngs", "Young's").replace("poisson", "Poisson's")


def display_of_predictor(name: str, unit: str | None) -> Display:
    """How a predictor in this SI unit is shown: `tip_youngs_modulus` in `Pa` in GPa."""
    written = (unit or "").replace("2", "²").replace("3", "³")
    endings = (entry.ending for entry in UNIT_ENDINGS if entry.shown and entry.unit == written)
    return display_of(f"{name}{next(endings, '')}")


def display_of_unit(unit: str) -> Display:
    """How a channel in this SI unit is shown: `m/s2` in g, `N` in kN; a unit that is not known
    stays as it is."""
    return Display("channel", *(("1", 1.0) if unit == "dimensionless" else shown_unit(unit)))


def si_unit_of(key: str) -> str:
    """The SI unit that the end of a key says, or "" where it says none."""
    return _display_of(key, "si").unit


def key_of(name: str, keys: Iterable[str]) -> str:
    """The key that a person names: itself, or the words of its heading, with or without unit
    (`"peak force (kN)"`).

    `name` itself where no key is meant.
    """
    key_list = list(keys)
    if name in key_list:
        return name
    words = name.partition("(")[0].strip().lower().replace("_", " ")
    return next(
        (key for key in key_list if words in (_display_of(key, "si").label.lower(), _words(key))),
        name,
    )


def _words(key: str) -> str:
    entry = unit_ending(key)
    return key.removesuffix("" if entry is None else entry.ending).replace("_", " ")


def heading(key: str) -> str:
    """`contact_time_s` -> `contact time (ms)`."""
    return display_of(key).heading


def cell(key: str, value: Any) -> str:
    """A value of a row of data below its heading: a number in the shown unit to four digits, a dash
    for none."""
    if value is None or value == "":
        return NOTHING
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return format_number(value * display_of(key).scale)
    return str(value)


def measured_cell(key: str, value: float, uncertainty: float) -> str:
    """A value in SI with its standard uncertainty, in the shown unit: `5.62 ± 0.11`."""
    scale = display_of(key).scale
    return measured_text(scale * value, scale * uncertainty)


def velocity_with_uncertainty(shot: Mapping[str, Any]) -> dict[str, Any]:
    """A row of a shot whose measured velocity is a cell with its standard uncertainty, in the place
    of the two."""
    key, uncertainty = "measured_velocity_m_s", "measured_velocity_u_m_s"
    joined = {name: value for name, value in shot.items() if name != uncertainty}
    if shot[key] is not None and shot[uncertainty]:
        joined[key] = measured_cell(key, shot[key], shot[uncertainty])
    return joined


def level_words(key: str, level: float | str | None) -> str:
    """A level of a factor by itself: `30 mm`, `steel`; a layer that is missing by its name: `no
    insulator`."""
    display = display_of(key)
    if level is None or level == NONE:
        return f"no {display.label}"
    return f"{cell(key, level)} {display.unit}".rstrip() if isinstance(level, float) else level


def named_level(key: str, level: float | str | None) -> str:
    """A level with its factor: `tip radius 30 mm`."""
    words = level_words(key, level)
    return words if words == f"no {display_of(key).label}" else f"{display_of(key).label} {words}"


def settings_words(levels: Mapping[str, float | str | None]) -> str:
    """Levels by their keys: `steel, 30 mm, no insulator`."""
    return ", ".join(level_words(key, level) for key, level in levels.items()) or "all alike"


#: SI unit of a parameter that no key names -> unit of the field, units of the field in one SI unit.
_COMPOUND_UNITS = {"m/N": ("mm/kN", 1e6), "1/N": ("1/kN", 1e3), "m3": ("cm³", 1e6)}


def shown_unit(si_unit: str) -> tuple[str, float]:
    """The unit that a value in `si_unit` is shown in, and how many of them one SI unit is: `Pa` is
    shown in bar."""
    si_unit = si_unit.replace("m/s2", "m/s²")
    if units() == "si":
        return si_unit, 1.0
    table = {entry.unit: (entry.shown, entry.scale) for entry in UNIT_ENDINGS if entry.shown}
    return table.get(si_unit) or _COMPOUND_UNITS.get(si_unit) or (si_unit, 1.0)


#: A number of a message with its unit; a number with an exponent stands alone, too. An impulse in N
#: s stays as it is.
_QUANTITY = re.compile(
    r"(?<![\w.-])(-?\d+(?:\.\d+)?(?:e[+-]?\d+)?)(?: (m/s2|Pa|N(?! s\b)|s)(?![\w/]))?(?![\w-])"
)


def in_shown_units(message: str) -> str:
    """A stored message with its quantities in the shown units: `-98066.5 m/s2 from 0.4 s` as
    `-10000 g from 400 ms`.

    Durations of a second and more stay in seconds, forces below a kilonewton in newton.
    """

    def shown(quantity: re.Match[str]) -> str:
        text, si_unit = quantity.groups()
        size = abs(float(text))
        if si_unit is None or (si_unit == "s" and size >= 1) or (si_unit == "N" and size < 1000):
            return (
                quantity[0].replace(text, format_number(float(text)))
                if "e" in text
                else quantity[0]
            )
        unit, scale = shown_unit(si_unit)
        return f"{format_number(scale * float(text))} {unit}"

    return _QUANTITY.sub(shown, message)
