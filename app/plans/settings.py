"""What follows from a plan's treatments: tank pressures by the nominal gun, every run held against the bench."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from sqlalchemy import select

from ...doe.guards import TANK_PRESSURE, planned_shots, pressures_for_levels, refuse_unsafe
from ...doe.limits.bench import read_limits
from ...doe.limits.contact_force import Elastic
from ...doe.space import Space
from ...ingest.folder import read_campaign_file
from ...schema.benches import Material, material_names
from ...schema.known_factors import BY_COLUMN, parse_number
from ...schema.session import Store
from ...twin.gun.nominal import GunBench, muzzle_velocity, tank_pressure_for

#: The bench of the shipped shots: the thesis's gun.
SHIPPED_BENCH = Path(__file__).resolve().parents[2] / "examples" / "first-shots"
VELOCITY_LEVEL, MASS = "velocity_level", "bullet_mass_kg"

Rows = Sequence[Mapping[str, str]]


def gun_bench(folder: Path | None) -> GunBench:
    """The gun of a campaign folder's campaign.toml; of the shipped shots where none is named."""
    file = read_campaign_file(folder or SHIPPED_BENCH)
    if file.gun is None:
        raise ValueError(f"{folder}: its campaign.toml has no [bench.gun] to plan tank pressures with")
    return GunBench(**vars(file.gun))


def run_settings(store: Store, space: Space, rows: Rows, gun: GunBench) -> list[dict[str, float]]:
    """What follows from each treatment: a gun's tank pressure, unless it is a factor. Every run is held against the
    bench.

    Raises `doe.guards.UnsafeRunError` with the numbers where a run is beyond it, and `ValueError` for a gun's factors
    without a mass, and without either velocity levels or a tank pressure.
    """
    if space.kind != "gun":
        return [{} for _ in rows]
    velocities = _velocities(space)
    masses = sorted({parse_number(row[MASS]) for row in rows})
    pressures = pressures_for_levels(velocities, masses, lambda v, m: float(tank_pressure_for(gun, v, m)))
    materials = _elastic(store, space)
    shots = planned_shots(rows, velocities, pressures, materials, lambda p, m: float(muzzle_velocity(gun, p, m)))
    refuse_unsafe(shots, read_limits(space.bench))
    if not velocities:  # the pressure is a factor
        return [{} for _ in rows]
    return [{TANK_PRESSURE: float(f"{shot.tank_pressure_pa / 1e5:.4g}")} for shot in shots]


def numbered(rows: Rows, numbers: Sequence[int]) -> list[dict[str, str]]:
    """The rows with their run numbers, by which a refusal names them."""
    return [{"run": str(number), **row} for number, row in zip(numbers, rows, strict=True)]


def _velocities(space: Space) -> dict[str, float]:
    """What the velocity levels stand for; none where the tank pressure is a factor in their place."""
    by_column = {factor.column: factor for factor in space.factors}
    level = by_column.get(VELOCITY_LEVEL)
    has_pressure = TANK_PRESSURE in by_column
    if MASS not in by_column or (level is not None) == has_pressure or (level is not None and level.values is None):
        raise ValueError(
            f"factors {space.name!r}: a gun's plan needs {MASS}, and either {TANK_PRESSURE}, or {VELOCITY_LEVEL} as an "
            "ordered factor with values in m/s"
        )
    if level is None or level.values is None:
        return {}
    return dict(zip(level.levels, level.values, strict=True))


def _elastic(store: Store, space: Space) -> dict[str, Elastic]:
    """Elastic constants of every material that a level names, under the level's own spelling."""
    columns = [column for column, factor in BY_COLUMN.items() if factor.material]
    named = {level for factor in space.factors if factor.column in columns for level in factor.levels}
    with store.reading() as session:
        names = material_names(session)
        constants = {m.name: Elastic(m.youngs_modulus_pa, m.poisson_ratio) for m in session.scalars(select(Material))}
    return {level: constants[name] for level in named if (name := names(level)) is not None}
