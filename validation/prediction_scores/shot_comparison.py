"""Measured shots beside the twin's draws of them, quantity by quantity."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...twin.measured_shots import MeasuredShots
from ...twin.prediction import ShotDraws
from .failure_rules import PredictionFailure, ShotFactor, failures
from .quantity_score import ComparedValues, Measure, QuantityScore

_SCALARS = (
    ("velocity_m_s", Measure("velocity", "impact velocity", "ln", "m/s")),
    ("contact_time_s", Measure("contact_time", "contact time", "ln", "s")),
    ("peak_force_n", Measure("peak_force", "peak force", "ln", "N")),
    ("impulse_n_s", Measure("impulse", "impulse", "ln", "N s")),
)
_NO_ANVIL = "none"


@dataclass(frozen=True, eq=False)
class QuantityComparison:
    """All measured values of a quantity, one or more (lines of a spectrum) a shot: arrays (n,) go
    with `values`.

    `shot` is the row of the shot in the measured shots, `frequency_hz` the line of a spectrum and
    NaN elsewhere.
    """

    measure: Measure
    values: ComparedValues
    shot: NDArray[np.intp]
    configuration: NDArray[np.intp]
    frequency_hz: Floats

    @property
    def score(self) -> QuantityScore:
        return QuantityScore.of(self.measure, self.values, self.shot, self.configuration)

    @property
    def is_spectrum(self) -> bool:
        return bool(np.isfinite(self.frequency_hz).any())

    def failures(self, shots: MeasuredShots, rng: np.random.Generator) -> list[PredictionFailure]:
        """Of the means over the lines of each shot."""
        rows, place = np.unique(self.shot, return_inverse=True)
        residual = np.bincount(place, self.values.residual) / np.bincount(place)
        return failures(
            self.measure, residual, shots.configuration[rows], _factors(shots.take(rows)), rng
        )


def compared_shots(
    shots: MeasuredShots, draws: Mapping[int, ShotDraws], rng: np.random.Generator
) -> list[QuantityComparison]:
    """Each quantity that was measured, of the shots (rows of `shots`) that have draws.

    A gun's velocity is compared, a velocity or a force that was given to the twin is not. Draws of
    the velocity have the uncertainty of its measurement added, from `rng`: a band is one of the
    measured value.
    """
    quantities = [(measure, _scalar(name, rng)) for name, measure in _SCALARS]
    sensors = [
        (number, sensor)
        for number, sensor in enumerate(shots.sensors)
        if np.isfinite(shots.spectra_m_s2[:, number]).any()
    ]
    for number, sensor in sensors:
        measure = Measure(
            f"peak_acceleration_{sensor}", f"peak acceleration at {sensor}", "ln", "m/s2"
        )
        quantities.append((measure, _peak(number)))
    for number, sensor in sensors:
        quantities.append(
            (Measure(f"srs_{sensor}", f"spectrum at {sensor}", "dB", "m/s2"), _spectrum(number))
        )
    comparisons = [_joined(measure, values, shots, draws) for measure, values in quantities]
    return [comparison for comparison in comparisons if comparison is not None]


#: Measured values (m,) of a shot (NaN where there is none) and the draws (d, m) of them, SI.
_Values = Callable[[MeasuredShots, int, ShotDraws], tuple[Floats, Floats]]


def _joined(
    measure: Measure, values_of: _Values, shots: MeasuredShots, draws: Mapping[int, ShotDraws]
) -> QuantityComparison | None:
    """None where no shot has a value."""
    values, rows, lines = [], [], []
    for row, shot_draws in draws.items():
        measured, predicted = map(measure.level, values_of(shots, row, shot_draws))
        usable = np.isfinite(measured) & np.isfinite(predicted).all(axis=0)
        if usable.any():
            values.append(ComparedValues.of(predicted[:, usable], measured[usable]))
            rows.append(np.full(int(usable.sum()), row))
            lines.append(shots.frequency_hz[usable] if measure.unit == "dB" else np.array([np.nan]))
    if not values:
        return None
    shot = np.concatenate(rows)
    return QuantityComparison(
        measure,
        ComparedValues.joined(values),
        shot,
        shots.configuration[shot],
        np.concatenate(lines),
    )


def _scalar(name: str, rng: np.random.Generator) -> _Values:
    def values(shots: MeasuredShots, row: int, draws: ShotDraws) -> tuple[Floats, Floats]:
        if name == "velocity_m_s":
            return _velocity(shots, row, draws.velocity_m_s, rng)
        if shots.force_is_given[row]:
            return np.array([np.nan]), getattr(draws, name)[:, None]
        return getattr(shots, name)[[row]], getattr(draws, name)[:, None]

    return values


def _velocity(
    shots: MeasuredShots, row: int, draws: Floats, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    measured, uncertainty = shots.impact_velocity_m_s[row], shots.impact_velocity_u_m_s[row]
    if shots.settings[row].tank_pressure_pa is None or not measured > 0:
        return np.array([np.nan]), draws[:, None]
    relative = np.nan_to_num(uncertainty / measured)
    return np.array([measured]), (draws * np.exp(relative * rng.normal(size=draws.size)))[:, None]


def _peak(sensor: int) -> _Values:
    return lambda shots, row, draws: (
        shots.peak_acceleration_m_s2[row, [sensor]],
        draws.peak_acceleration_m_s2[:, [sensor]],
    )


def _spectrum(sensor: int) -> _Values:
    return lambda shots, row, draws: (
        shots.spectra_m_s2[row, sensor],
        draws.spectra_m_s2[:, sensor],
    )


def _factors(shots: MeasuredShots) -> list[ShotFactor]:
    """What the operator sets, in the words of a plan; what never varies makes no rule."""
    settings = shots.settings
    words = {
        "tip_material": [s.tip.name for s in settings],
        "plate_material": [s.plate.name for s in settings],
        "anvil_material": [s.anvil.name if s.anvil is not None else _NO_ANVIL for s in settings],
        "insulator": [s.insulator for s in settings],
        "impact_position": [s.impact_position for s in settings],
        "boundary_conditions": [s.boundary_conditions for s in settings],
    }
    factors = [ShotFactor(name, np.array(values)) for name, values in words.items()]
    fired = all(s.tank_pressure_pa is not None for s in settings)
    numbers = [
        (
            "bullet_mass" if fired else "impactor_mass",
            [s.impactor_mass_kg for s in settings],
            "kg",
            1.0,
        ),
        ("tip_radius", [s.tip_radius_m for s in settings], "mm", 1e3),
    ]
    if shots.force_is_given.any():  # mass and velocity stand in for what is not known
        numbers[0] = ("peak_force", shots.peak_force_n.tolist(), "N", 1.0)
        numbers.append(("contact_time", shots.contact_time_s.tolist(), "ms", 1e3))
    elif fired:
        numbers.append(
            ("tank_pressure", [s.tank_pressure_pa or 0.0 for s in settings], "bar", 1e-5)
        )
    else:
        numbers.append(("impact_velocity", shots.impact_velocity_m_s.tolist(), "m/s", 1.0))
    factors += [
        ShotFactor(name, np.array(values, dtype=np.float64), unit, shown)
        for name, values, unit, shown in numbers
        if np.isfinite(values).all()
    ]
    return [factor for factor in factors if len(set(factor.values.tolist())) > 1]


def shot_rows(
    shots: MeasuredShots, comparisons: list[QuantityComparison]
) -> Iterator[dict[str, object]]:
    """A row for each shot that was predicted: its setting, and measured and predicted value of each
    quantity, SI."""
    places = {
        comparison.measure: dict(
            zip(comparison.shot.tolist(), range(len(comparison.shot)), strict=True)
        )
        for comparison in comparisons
        if not comparison.is_spectrum
    }
    for row in sorted({row for comparison in comparisons for row in comparison.shot.tolist()}):
        quantities = {}
        for comparison in comparisons:
            place = places.get(comparison.measure, {}).get(row)
            if place is not None:
                values = comparison.values
                names = {
                    "measured": "measured",
                    "predicted": "median",
                    "low90": "low90",
                    "high90": "high90",
                }
                levels = {
                    key: float(np.exp(getattr(values, name)[place])) for key, name in names.items()
                }
                quantities[comparison.measure.name] = {**levels, "rank": float(values.rank[place])}
        yield {
            "shot": row,
            "configuration": int(shots.configuration[row]),
            "quantities": quantities,
        }


def line_rows(comparison: QuantityComparison) -> list[dict[str, float]]:
    """Of a spectrum, for each line: the shares inside of the bands and the median absolute error
    (dB)."""
    lines = np.unique(comparison.frequency_hz)
    rows = []
    for line in lines.tolist():
        values = comparison.values.take(comparison.frequency_hz == line)
        rows.append(
            {
                "frequency_hz": line,
                "coverage50": float(values.inside50.mean()),
                "coverage90": float(values.inside90.mean()),
                "median_abs_error": float(np.median(np.abs(values.residual))),
                "bias": float(values.residual.mean()),
            }
        )
    return rows
