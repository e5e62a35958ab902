"""Plans that can be fired: a design, its tank pressures by the nominal gun, and the guard over
every run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np
from sqlalchemy import select

from ....doe.designs.base import Design
from ....doe.designs.imported import ImportedDesign
from ....doe.designs.methods import DesignRequest, get_method
from ....doe.designs.repeats import replicated, with_centre_points
from ....doe.guards import TANK_PRESSURE, planned_shots, pressures_for_levels, refuse_unsafe
from ....doe.limits.bench import read_limits
from ....doe.limits.contact_force import Elastic
from ....doe.order import RunOrder, run_order
from ....doe.plans import StoredPlan, add_plan, extend_plan, read_plan
from ....doe.space import Kind, Space, shipped_factors, space_from_text
from ....doe.toml_space import with_ranges
from ....files.delimited_text import parse_number
from ....schema.benches import Material, material_names
from ....schema.known_factors import BY_COLUMN, BY_NAME
from ....schema.session import Store
from ....twin.gun.nominal import GunBench, muzzle_velocity, tank_pressure_for
from ...common.frames import si

#: The bench of the shipped shots: the thesis's gun.
SHIPPED_BENCH = Path(__file__).resolve().parents[3] / "examples" / "first-shots"
VELOCITY_LEVEL, MASS = "velocity_level", "bullet_mass_kg"

Rows = Sequence[Mapping[str, str]]


def gun_bench(folder: Path | None) -> GunBench:
    """The gun of a campaign folder's campaign.toml; of the shipped shots where none is named."""
    from ....ingest.folder.campaign_file import read_campaign_file

    file = read_campaign_file(folder or SHIPPED_BENCH)
    if file.gun is None:
        raise ValueError(
            f"{folder}: its campaign.toml has no [bench.gun] to plan tank pressures with"
        )
    return GunBench(**vars(file.gun))


def run_settings(store: Store, space: Space, rows: Rows, gun: GunBench) -> list[dict[str, float]]:
    """What follows from each treatment: a gun's tank pressure, unless it is a factor. Every run is
    held against the bench.

    Raises `doe.guards.UnsafeRunError` with the numbers where a run is beyond it, and `ValueError`
    for a gun's factors without a mass, and without either velocity levels or a tank pressure.
    """
    if space.kind != "gun":
        return [{} for _ in rows]
    velocities = _velocities(space)
    masses = sorted({parse_number(row[MASS]) for row in rows})
    pressures = pressures_for_levels(
        velocities, masses, lambda v, m: float(tank_pressure_for(gun, v, m))
    )
    materials = _elastic(store, space)
    shots = planned_shots(
        rows, velocities, pressures, materials, lambda p, m: float(muzzle_velocity(gun, p, m))
    )
    refuse_unsafe(shots, read_limits(space.bench))
    if not velocities:  # the pressure is a factor
        return [{} for _ in rows]
    return [{TANK_PRESSURE: float(f"{shot.tank_pressure_pa / 1e5:.4g}")} for shot in shots]


def numbered(rows: Rows, numbers: Sequence[int]) -> list[dict[str, str]]:
    """The rows with their run numbers, by which a refusal names them."""
    return [{"run": str(number), **row} for number, row in zip(numbers, rows, strict=True)]


def _velocities(space: Space) -> dict[str, float]:
    """What the velocity levels stand for; none where the tank pressure is a factor in their
    place."""
    by_column = {factor.column: factor for factor in space.factors}
    level = by_column.get(VELOCITY_LEVEL)
    has_pressure = TANK_PRESSURE in by_column
    if (
        MASS not in by_column
        or (level is not None) == has_pressure
        or (level is not None and level.values is None)
    ):
        raise ValueError(
            f"factors {space.name!r}: a gun's plan needs {MASS}, and either {TANK_PRESSURE}, or "
            f"{VELOCITY_LEVEL} as an ordered factor with values in m/s"
        )
    if level is None or level.values is None:
        return {}
    return dict(zip(level.levels, level.values, strict=True))


def _elastic(store: Store, space: Space) -> dict[str, Elastic]:
    """Elastic constants of every material that a level names, under the level's own spelling."""
    columns = [column for column, factor in BY_COLUMN.items() if factor.material]
    named = {
        level for factor in space.factors if factor.column in columns for level in factor.levels
    }
    with store.reading() as session:
        names = material_names(session)
        constants = {
            m.name: Elastic(m.youngs_modulus_pa, m.poisson_ratio)
            for m in session.scalars(select(Material))
        }
    return {level: constants[name] for level in named if (name := names(level)) is not None}


@dataclass(frozen=True)
class PlanDraft:
    """A plan that is made and not stored yet; `runs` are the numbers of its runs where a table
    tells them."""

    name: str
    factors: str
    design: Design
    gun: GunBench
    repetitions: int
    runs: Sequence[int] | None = None
    description: str | None = None


def make_plan(store: Store, method: str, name: str, **given: Any) -> StoredPlan:
    """`draft_plan`, stored: for the command line and for the web alike. Raises as it does, and as
    `store_draft`."""
    return store_draft(store, draft_plan(method, name, **given))


def draft_plan(
    method: str,
    name: str,
    *,
    kind: Kind = "gun",
    factors: str | None = None,
    runs: int | None = None,
    table: Path | None = None,
    repetitions: int = 10,
    seed: int | None = None,
    gun: Path | None = None,
    description: str | None = None,
    options: Mapping[str, Any] | None = None,
    ranges: Mapping[str, Sequence[float]] | None = None,
    replicates: int = 1,
    centre_points: int = 0,
    order: RunOrder = "split-plot",
    blocks: int = 1,
) -> PlanDraft:
    """Make a design, to be stored as plan `name`. The search for a balanced one takes seconds to
    minutes.

    `method` is one of `doe.designs.methods.METHODS`: "lhs" takes the number of `runs`, "import" a
    CSV `table`; `options` are those of the method. `factors` is the text of a factors file, else
    the shipped one of `kind`; `ranges` makes factors of it continuous (`doe.ranges.with_ranges`);
    `gun` is a campaign folder whose gun fires the plan. Without a `seed` one is drawn, which the
    plan keeps. The whole design comes `replicates` times, with `centre_points` beside it
    (`doe.designs.repeats`), in the `order` and `blocks` of `doe.order.run_order`; an imported table
    keeps its own runs and order. Raises `ValueError` for what the method lacks.
    """
    if not name.strip():
        raise ValueError("the plan has no name; expected one")
    if repetitions < 1:
        raise ValueError(f"repetitions is {repetitions}; expected 1 or more")
    text = with_ranges(
        factors if factors is not None else shipped_factors(_checked_kind(kind)), ranges or {}
    )
    plan_seed = _seed(seed)
    rng = np.random.default_rng(plan_seed)
    design_method = get_method(method)
    if centre_points and not design_method.centre_points:
        raise ValueError(
            f"centre_points is {centre_points}; expected 0, as {method!r} has "
            f"an own number of them or none"
        )
    fired_by = gun_bench(gun)
    unordered = design_method.make(
        space_from_text(text), DesignRequest(runs, table, rng, options or {})
    )
    numbers: Sequence[int] | None = None
    design: Design
    if isinstance(unordered, ImportedDesign):
        if (replicates, centre_points, order, blocks) != (1, 0, "split-plot", 1):
            raise ValueError(
                "an imported table keeps its own runs and order; leave out "
                "replicates, centre points, order and blocks"
            )
        design, numbers = unordered, unordered.runs
    else:
        repeated = with_centre_points(replicated(unordered, replicates), centre_points, rng)
        design = in_order(repeated, rng, plan_seed, order, blocks)
    return PlanDraft(name, text, design, fired_by, repetitions, numbers, description)


def store_draft(store: Store, draft: PlanDraft) -> StoredPlan:
    """Store a plan, and read it back. Raises `PlanExistsError`, `doe.guards.UnsafeRunError`."""
    store_design(
        store,
        draft.name,
        draft.factors,
        draft.design,
        draft.gun,
        repetitions=draft.repetitions,
        runs=draft.runs,
        description=draft.description,
    )
    with store.reading() as session:
        return read_plan(session, draft.name)


def _checked_kind(text: str) -> Kind:
    if text not in get_args(Kind):
        raise ValueError(f"kind is {text!r}; expected one of {', '.join(get_args(Kind))}")
    return cast(Kind, text)


def _seed(seed: int | None) -> int:
    import secrets

    drawn = seed if seed is not None else secrets.randbelow(2**31)
    if drawn < 0:
        raise ValueError(f"seed is {drawn}; expected 0 or more")
    return drawn


def store_design(
    store: Store,
    name: str,
    factors: str,
    design: Design,
    gun: GunBench,
    *,
    repetitions: int,
    runs: Sequence[int] | None = None,
    description: str | None = None,
) -> None:
    """Store a design as a plan that can be fired; nothing is stored where a run is beyond the
    bench."""
    numbers = list(runs) if runs is not None else list(range(1, len(design.treatments) + 1))
    settings = run_settings(store, design.space, numbered(design.rows, numbers), gun)
    add_plan(
        store,
        name,
        factors,
        design,
        repetitions=repetitions,
        settings=settings,
        runs=numbers,
        description=description,
    )


def in_order(
    design: Design,
    rng: np.random.Generator,
    seed: int | None,
    order: RunOrder = "split-plot",
    blocks: int = 1,
) -> Design:
    """The design with its treatments in order of run, as `doe.order.run_order`; its method names
    what is unusual."""
    treatments = design.treatments[run_order(design.space, design.treatments, rng, order, blocks)]
    unusual = [f"order={order}"] * (order != "split-plot") + [f"blocks={blocks}"] * (blocks != 1)
    return Design(design.space, treatments, " ".join([design.method, *unusual]), seed)


@dataclass(frozen=True)
class PlanAddition:
    """Runs that are made and not stored yet, from number `first` on."""

    name: str
    rows: Rows
    first: int
    repetitions: int
    settings: Sequence[Mapping[str, float]]

    def store(self, store: Store) -> list[int]:
        """Store them; returns their numbers."""
        return extend_plan(
            store, self.name, self.rows, repetitions=self.repetitions, settings=self.settings
        )


def draft_addition(
    store: Store, plan: StoredPlan, runs: int, repetitions: int, seed: int, gun: GunBench
) -> PlanAddition:
    """Further `runs` of a plan, balanced beside what is recorded and still to do."""
    from ....doe.designs.augment import augment
    from ....doe.designs.lhs import balance_levels

    rng = np.random.default_rng(seed)
    kept = plan.treatments("planned", "done")
    design = augment(
        plan.space, kept, runs, lambda space, n, fixed: balance_levels(space, n, rng, fixed=fixed)
    )
    rows = in_order(design, rng, seed).rows
    first = 1 + max((run.run for run in plan.runs), default=0)
    settings = run_settings(store, plan.space, numbered(rows, range(first, first + runs)), gun)
    return PlanAddition(plan.name, rows, first, repetitions, settings)


def range_in_column(name: str, limits: Sequence[Any]) -> tuple[float, ...]:
    """Limits and step in the unit of the factor's column."""
    factor = BY_NAME.get(name) or BY_COLUMN.get(name)
    if factor is None or factor.si_unit is None:
        return tuple(si(value, "", f"range of {name}") for value in limits)
    name_of_column = name == factor.column and name != factor.name

    def in_column(value: Any) -> float:
        has_unit = isinstance(value, str) or hasattr(value, "to")
        number = si(value, str(factor.si_unit), f"range of {name}")
        return number if name_of_column and not has_unit else number / factor.scale

    return tuple(map(in_column, limits))
