"""The guard: every planned shot against the bench, before anything is fired.

The estimates err on the safe side: the peak force of a planned shot is Hertz's, without plasticity
or any give, unless the plan brings a better one. The acceleration of the plate is the one estimate
that can be too low: see `check_run`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeVar

from ..files.delimited_text import parse_number
from ..schema.known_factors import BY_COLUMN
from .limits.ballistic import positive
from .limits.bench import BenchLimits, Swing
from .limits.contact_force import Elastic, hertz_contact, raised_sine_peak_force

TANK_PRESSURE = "tank_pressure_bar"

K = TypeVar("K")
V = TypeVar("V")


@dataclass(frozen=True)
class PlannedShot:
    """One shot of the gun as planned, with what is expected of its contact.

    At least one of `peak_force_n` and `contact_time_s` is needed; the other follows from eq. 2.5
    (complete transfer of the momentum, so that a bullet that rebounds gives up to twice as much:
    bring the peak where it is known). Raises `ValueError` naming the run and the field where a
    value is missing or not positive.
    """

    run: str
    tank_pressure_pa: float  # gauge
    bullet_mass_kg: float
    impact_velocity_m_s: float
    plate: str  # a name that the bench's limits know
    anvil: str = "none"
    peak_force_n: float | None = None
    contact_time_s: float | None = None
    chain_height_m: float = 0.0  # by which the plate hangs higher than usual

    def __post_init__(self) -> None:
        if self.peak_force_n is None and self.contact_time_s is None:
            raise ValueError(f"run {self.run}: expected peak_force_n or contact_time_s, or both")
        named = (
            "tank_pressure_pa",
            "bullet_mass_kg",
            "impact_velocity_m_s",
            "peak_force_n",
            "contact_time_s",
        )
        values = {name: getattr(self, name) for name in named}
        try:
            positive(**{name: value for name, value in values.items() if value is not None})
        except ValueError as error:
            raise ValueError(f"run {self.run}: {error}") from None

    @property
    def momentum_kg_m_s(self) -> float:
        return self.bullet_mass_kg * self.impact_velocity_m_s

    @property
    def expected_peak_force_n(self) -> float:
        """The peak given, or eq. 2.5 from the contact time."""
        if self.peak_force_n is not None:
            return self.peak_force_n
        assert self.contact_time_s is not None  # __post_init__
        return raised_sine_peak_force(
            self.bullet_mass_kg, self.impact_velocity_m_s, self.contact_time_s
        )

    @property
    def expected_contact_time_s(self) -> float:
        """The contact time given, or eq. 2.5 from the peak."""
        return self.contact_time_s or 2 * self.momentum_kg_m_s / self.expected_peak_force_n


@dataclass(frozen=True)
class Exceeded:
    """One limit that a shot is beyond."""

    limit: str  # the limit's name in `BenchLimits`; the safety plate's is "safety_plate"
    value: float
    allowed: float
    unit: str
    message: str


class UnsafeRunError(ValueError):
    """Planned runs beyond the bench. `exceeded` has each of them with all its limits, in the order
    of the plan."""

    def __init__(self, exceeded: Sequence[tuple[PlannedShot, list[Exceeded]]], runs: int) -> None:
        self.exceeded = tuple(exceeded)
        named = [
            f"run {run.run}: {', '.join(item.message for item in items)}" for run, items in exceeded
        ]
        more = f"; and {len(named) - _NAMED_RUNS} more" if len(named) > _NAMED_RUNS else ""
        super().__init__(
            f"{len(named)} of {runs} planned runs beyond the bench: "
            f"{'; '.join(named[:_NAMED_RUNS])}{more}"
        )


_NAMED_RUNS = 5  # in an error's one line
_Check = tuple[str, str, float, float, str]  # limit, words, value, allowed, unit


def check_run(run: PlannedShot, limits: BenchLimits) -> list[Exceeded]:
    """Every limit that a shot is beyond; none for a shot that the bench withstands. A value at its
    limit passes.

    The safety plate allows its ballistic limit for the bullet's mass, over the margin. The plate's
    acceleration is that of a rigid body under the expected peak force (eq. 2.9), which a sensor
    close to the impact exceeds; where `accelerometer_distance_m` is known, the larger of it and the
    bound on the bending wave. The suspension is judged where `pendulum_length_m` is known.

    Parameters:
        run: The shot as planned.
        limits: What the bench withstands.

    Raises:
        ValueError: For a plate that the limits do not know, and for a chain height without
            `pendulum_length_m` or beyond it.
    """
    return [
        Exceeded(
            limit,
            value,
            allowed,
            unit,
            f"{words} {_figure(value)} {unit}, allowed {_figure(allowed)} ({limit})",
        )
        for limit, words, value, allowed, unit in (
            *_gun_checks(run, limits),
            *_impact_checks(run, limits),
            *_suspension_checks(run, limits),
        )
        if value > allowed
    ]


def refuse_unsafe(runs: Iterable[PlannedShot], limits: BenchLimits) -> None:
    """Check that the bench withstands all planned shots.

    Parameters:
        runs: The shots of a plan, in its order.
        limits: What the bench withstands.

    Raises:
        UnsafeRunError: For shots that are beyond the bench, naming each run, limit, value and what
            is allowed.
        ValueError: As `check_run` raises it.
    """
    planned = list(runs)
    checked_runs = [(run, check_run(run, limits)) for run in planned]
    exceeded = [(run, items) for run, items in checked_runs if items]
    if exceeded:
        raise UnsafeRunError(exceeded, len(planned))


def pressures_for_levels(
    levels_m_s: Mapping[str, float],
    masses_kg: Sequence[float],
    pressure_for: Callable[[float, float], float],
) -> dict[tuple[str, float], float]:
    """Gauge tank pressure (Pa) of each velocity level and bullet mass.

    Parameters:
        levels_m_s: The velocity in m/s that each level stands for, by the level's name.
        masses_kg: The masses of the bullets.
        pressure_for: The gun's model: a function of the velocity in m/s and the bullet mass in kg
            that gives the gauge tank pressure in Pa.

    Returns:
        The pressures, each by a pair of level and mass in kg.

    Raises:
        ValueError: For a velocity, a mass or a resulting pressure that is not positive and finite.
    """
    pressures = {}
    for level, velocity_m_s in levels_m_s.items():
        for mass_kg in masses_kg:
            positive(**{f"velocity of level {level!r}": velocity_m_s, "bullet_mass_kg": mass_kg})
            pressure_pa = float(pressure_for(velocity_m_s, mass_kg))
            positive(**{f"tank_pressure_pa for level {level!r} and {mass_kg:g} kg": pressure_pa})
            pressures[level, mass_kg] = pressure_pa
    return pressures


def planned_shots(
    rows: Sequence[Mapping[str, str]],
    levels_m_s: Mapping[str, float],
    pressures_pa: Mapping[tuple[str, float], float],
    materials: Mapping[str, Elastic],
    velocity_for: Callable[[float, float], float] | None = None,
) -> list[PlannedShot]:
    """Shots of a gun plan's rows, with Hertz's contact.

    The bullet meets the anvil where there is one, else the plate. An insulator is left out, which
    errs on the safe side.

    Parameters:
        rows: Column to level for each run, with the columns of Table A.1. `run` is counted from 1
            where absent. `tank_pressure_bar` may stand in place of a velocity level.
        levels_m_s: The velocity in m/s that each level stands for, by the level's name.
        pressures_pa: Gauge tank pressure for each velocity level and bullet mass in kg, as
            `pressures_for_levels` gives it.
        materials: The elastic constants of each material, by its name in the rows.
        velocity_for: A function of the gauge tank pressure in Pa and the bullet mass in kg that
            gives the velocity in m/s of a row with `tank_pressure_bar`. By default there is none,
            and each row needs a velocity level.

    Raises:
        ValueError: For a material, a level or a mass that is not known, and a cell that is no
            positive number; the message names the run.
    """
    return [
        _shot(row, row.get("run", str(number)), levels_m_s, pressures_pa, materials, velocity_for)
        for number, row in enumerate(rows, 1)
    ]


def _figure(value: float) -> str:
    return f"{value:,.0f}" if value >= 1e4 else f"{value:.4g}"


def _gun_checks(run: PlannedShot, limits: BenchLimits) -> Iterator[_Check]:
    for limit in ("max_tank_pressure_pa", "max_regulated_pressure_pa", "max_valve_pressure_pa"):
        yield limit, "tank pressure", run.tank_pressure_pa, getattr(limits, limit), "Pa"
    velocity = run.impact_velocity_m_s
    stopped = limits.ballistic_limit(run.bullet_mass_kg) / limits.safety_plate_margin
    yield "safety_plate", "impact velocity", velocity, stopped, "m/s"
    yield "max_bullet_mass_kg", "bullet mass", run.bullet_mass_kg, limits.max_bullet_mass_kg, "kg"
    yield (
        "max_impact_velocity_m_s",
        "impact velocity",
        velocity,
        limits.max_impact_velocity_m_s,
        "m/s",
    )
    yield (
        "max_momentum_kg_m_s",
        "momentum",
        run.momentum_kg_m_s,
        limits.max_momentum_kg_m_s,
        "kg m/s",
    )


def _impact_checks(run: PlannedShot, limits: BenchLimits) -> Iterator[_Check]:
    force = run.expected_peak_force_n
    yield "max_contact_force_n", "expected peak force", force, limits.max_contact_force_n, "N"
    plate = limits.plate(run.plate)
    acceleration = plate.rigid_acceleration(force)
    if limits.accelerometer_distance_m is not None:
        wave = plate.wave_acceleration(
            force, run.expected_contact_time_s, limits.accelerometer_distance_m
        )
        acceleration = max(acceleration, wave)
    yield (
        "max_acceleration_m_s2",
        "expected plate acceleration",
        acceleration,
        limits.max_acceleration_m_s2,
        "m/s2",
    )


def _suspension_checks(run: PlannedShot, limits: BenchLimits) -> Iterator[_Check]:
    height = run.chain_height_m
    if limits.pendulum_length_m is None:
        if height:
            raise ValueError(
                f"run {run.run}: chain_height_mm is {1e3 * height:g}, which changes how the plate "
                "swings; state pendulum_length_m in [bench] of the factors, from the upper member "
                "to the plate's centre of mass"
            )
        return
    length = limits.pendulum_length_m - height
    if not length > 0:
        raise ValueError(
            f"run {run.run}: chain_height_mm is {1e3 * height:g}; expected less than "
            f"pendulum_length_m, {1e3 * limits.pendulum_length_m:g} mm"
        )
    swing = Swing(length, limits.plate(run.plate).mass_kg, run.momentum_kg_m_s)
    yield "max_chain_load_n", "chain load", swing.chain_load_n, limits.max_chain_load_n, "N"
    if limits.max_swing_m is not None:
        yield "max_swing_m", "swing of the plate", swing.reach_m, limits.max_swing_m, "m"
    radius = limits.bullet_diameter_m / 2
    for limit, words, direction, edge in (
        ("strike_to_lower_edge_m", "chain height", height, limits.strike_to_lower_edge_m),
        (
            "strike_to_upper_edge_m",
            "chain height below the usual",
            -height,
            limits.strike_to_upper_edge_m,
        ),
    ):
        if edge is not None:
            yield limit, words, direction, edge - radius, "m"


def _shot(
    row: Mapping[str, str],
    run: str,
    levels_m_s: Mapping[str, float],
    pressures_pa: Mapping[tuple[str, float], float],
    materials: Mapping[str, Elastic],
    velocity_for: Callable[[float, float], float] | None,
) -> PlannedShot:
    mass = _number(row, "bullet_mass_kg", run)
    if velocity_for is not None and TANK_PRESSURE in row:
        pressure = _number(row, TANK_PRESSURE, run) * BY_COLUMN[TANK_PRESSURE].scale
        velocity = velocity_for(pressure, mass)
        if not velocity > 0:
            raise ValueError(
                f"run {run}: {TANK_PRESSURE} is "
                f"{row[TANK_PRESSURE]}, which drives no {mass:g} kg out"
            )
    else:
        level = _text(row, "velocity_level", run)
        velocity = _lookup(levels_m_s, level, "velocity level", run)
        pressure = _lookup(pressures_pa, (level, mass), "pressure of level and mass", run)
    plate, anvil, tip = (_text(row, f"{part}_material", run) for part in ("plate", "anvil", "tip"))
    contact = hertz_contact(
        _lookup(materials, tip, "material", run),
        _lookup(materials, plate if anvil == "none" else anvil, "material", run),
        tip_radius_m=1e-3 * _number(row, "tip_radius_mm", run),
        bullet_mass_kg=mass,
        impact_velocity_m_s=velocity,
    )
    height = _chain_height_m(row, run)
    return PlannedShot(
        run,
        pressure,
        mass,
        velocity,
        plate,
        anvil,
        contact.peak_force_n,
        contact.contact_time_s,
        height,
    )


def _chain_height_m(row: Mapping[str, str], run: str) -> float:
    """Of the optional column; 0 without one."""
    factor = BY_COLUMN["chain_height_mm"]
    text = row.get(factor.column) or "0"
    try:
        cell = parse_number(text)
    except ValueError:
        cell = math.nan
    if not (math.isfinite(cell) and factor.allows(cell)):
        raise ValueError(
            f"run {run}: {factor.column} is {text!r}; expected {factor.expected_number}"
        )
    return cell * factor.scale


def _lookup(table: Mapping[K, V], key: K, what: str, run: str) -> V:
    if key not in table:
        raise ValueError(
            f"run {run}: {what} {key!r} is not known; expected one of {', '.join(map(repr, table))}"
        )
    return table[key]


def _text(row: Mapping[str, str], column: str, run: str) -> str:
    return _lookup(row, column, "column", run)


def _number(row: Mapping[str, str], column: str, run: str) -> float:
    text = _text(row, column, run)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value > 0):
        raise ValueError(f"run {run}: {column} is {text!r}; expected a positive number")
    return value
