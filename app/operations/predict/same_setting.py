"""The measured shots at the very setting that is predicted, held against its bands.

A prediction that is far from what the bench gave at the same setting is wrong, whatever its band
rests on; the page of the twin says so beside the number.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ....twin.tune.space import MASS_STEP_KG, PRESSURE_STEP_PA, RADIUS_STEP_M
from ...common.number_format import NOTHING, join_words
from ...common.quantities import cell, display_of
from ..sentence import Number, Sentence

if TYPE_CHECKING:
    from ....twin.prediction import Prediction
    from .nearest_shots import MeasuredShot

#: What can be set no finer at the bench; a velocity that a hand swings is the same within 5 %.
_STEPS = {
    "tank_pressure_pa": PRESSURE_STEP_PA,
    "bullet_mass_kg": MASS_STEP_KG,
    "tip_radius_m": RADIUS_STEP_M,
}
_SAME_VELOCITY = 0.05
#: Measured quantities of a shot, as the prediction and the shot call them.
_MEASURED = ("velocity_m_s", "contact_time_s", "peak_force_n")


@dataclass(frozen=True)
class MeasuredRange:
    """What shots of one setting measured of a quantity, SI: `count` values from `low` to `high`, of
    which `outside` lie outside of the predicted 90 % band."""

    quantity: str
    low: float
    high: float
    count: int
    outside: int

    @property
    def cell(self) -> str:
        """`7.376 to 7.567`, in the unit of the table."""
        ends = list(dict.fromkeys(cell(self.quantity, end) for end in (self.low, self.high)))
        return " to ".join(ends)

    @property
    def words(self) -> str:
        """`7.376 to 7.567 m/s`."""
        return f"{self.cell} {display_of(self.quantity).unit}"


def shots_of_setting(
    wanted: Mapping[str, str | float], shots: Sequence[MeasuredShot]
) -> list[MeasuredShot]:
    """Shots that differ from a setting by a step of the bench at most; what a shot does not state
    counts as the same."""
    return [shot for shot in shots if all(_is_same(name, wanted, shot) for name in wanted)]


def _is_same(name: str, wanted: Mapping[str, str | float], shot: MeasuredShot) -> bool:
    value = wanted[name]
    measured = shot.velocity_m_s if name == "impact_velocity_m_s" else shot.setting.get(name)
    if measured is None:
        return True
    if isinstance(value, str) or isinstance(measured, str):
        return str(value).lower() == str(measured).lower()
    step = _STEPS.get(name, _SAME_VELOCITY * value)
    return abs(measured - value) <= step * (1 + 1e-9)


def measured_ranges(
    prediction: Prediction, shots: Sequence[MeasuredShot]
) -> dict[str, MeasuredRange]:
    """By quantity, as far as it was measured in any of the shots."""
    ranges = {}
    for name in _MEASURED:
        values = [value for shot in shots if (value := getattr(shot, name)) is not None]
        if name == "velocity_m_s" and prediction.setting.tank_pressure_pa is None:
            continue  # the velocity was asked for
        if values:
            low, high = getattr(prediction, name).ci90
            outside = sum(not low <= value <= high for value in values)
            ranges[name] = MeasuredRange(name, min(values), max(values), len(values), outside)
    return ranges


def range_cells(ranges: Mapping[str, MeasuredRange], quantity: str) -> dict[str, str]:
    """Cells beside the prediction of a quantity: what was measured at this setting, and how many of
    the values lie outside of the band."""
    own = ranges.get(quantity)
    return {
        "measured": NOTHING if own is None else own.cell,
        "outside": NOTHING if own is None else f"{own.outside} of {own.count}",
    }


def setting_sentences(
    ranges: Mapping[str, MeasuredRange], prediction: Prediction
) -> Iterator[Sentence]:
    """What shots at this setting measured, and which of that lies outside of the bands."""
    if not ranges:
        return
    shots = Number("shots", max(own.count for own in ranges.values()), "count")
    listed = join_words([f"{display_of(name).label} {own.words}" for name, own in ranges.items()])
    plural = "" if shots.value == 1 else "s"
    numbers: list[Any] = [shots]
    for name, own in ranges.items():
        numbers += [Number(name, own.low), Number(name, own.high)]
    yield Sentence(f"{shots} shot{plural} at this setting measured: {listed}.", numbers)
    beyond = {name: own for name, own in ranges.items() if own.outside}
    if not beyond:
        yield Sentence("All of these values lie within the predicted 90 % bands.")
        return
    parts = [
        f"{own.outside} of {own.count} of the {display_of(name).label}"
        for name, own in beyond.items()
    ]
    sides = {
        "above" if getattr(prediction, name).mean > own.high else "below"
        for name, own in beyond.items()
        if not own.low <= getattr(prediction, name).mean <= own.high
    }
    side = f"; the prediction lies {sides.pop()} what was measured" if len(sides) == 1 else ""
    counts = [
        Number(f"{name} outside", number, "count")
        for name, own in beyond.items()
        for number in (own.outside, own.count)
    ]
    yield Sentence(f"Outside of the 90 % band lie {join_words(parts)}{side}.", counts)


def is_contradicted(ranges: Mapping[str, MeasuredRange]) -> bool:
    """Whether a measured value lies outside of its band."""
    return any(own.outside for own in ranges.values())
