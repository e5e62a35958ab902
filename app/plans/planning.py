"""Plans that can be fired: a design, its tank pressures by the gun model, and the guard over every run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, get_args

from ...doe.designs.base import Design
from ...doe.designs.methods import DesignRequest, get_method
from ...doe.plans import StoredPlan, add_plan, extend_plan, read_plan
from ...doe.space import Kind, Space, shipped_factors, space_from_text
from ...doe.toml_space import with_ranges
from ...schema.session import Store
from ...twin.gun.nominal import GunBench
from .settings import gun_bench, numbered, run_settings

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class PlanDraft:
    """A plan that is made and not stored yet; `runs` are the numbers of its runs where a table tells them."""

    name: str
    factors: str
    design: Design
    gun: GunBench
    repetitions: int
    runs: Sequence[int] | None = None
    description: str | None = None


def make_plan(store: Store, method: str, name: str, **given: Any) -> StoredPlan:
    """`draft_plan`, stored: for the command line and for the web alike. Raises as it does, and as `store_draft`."""
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
) -> PlanDraft:
    """Make a design, to be stored as plan `name`. The search for a balanced one takes seconds to minutes.

    `method` is one of `doe.designs.methods.METHODS`: "lhs" takes the number of `runs`, "import" a CSV `table`;
    `options` are those of the method. `factors` is the text of a factors file, else the shipped one of `kind`;
    `ranges` makes factors of it continuous (`doe.ranges.with_ranges`); `gun` is a campaign folder whose gun fires the
    plan. Without a `seed` one is drawn, which the plan keeps. Raises `ValueError` for what the method lacks.
    """
    if not name.strip():
        raise ValueError("the plan has no name; expected one")
    if repetitions < 1:
        raise ValueError(f"repetitions is {repetitions}; expected 1 or more")
    text = with_ranges(factors if factors is not None else shipped_factors(_kind(kind)), ranges or {})
    design, numbers = _design(method, space_from_text(text), runs, table, seed, options or {})
    return PlanDraft(name, text, design, gun_bench(gun), repetitions, numbers, description)


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


def _kind(text: str) -> Kind:
    if text not in get_args(Kind):
        raise ValueError(f"kind is {text!r}; expected one of {', '.join(get_args(Kind))}")
    return cast(Kind, text)


def _design(
    method: str, space: Space, runs: int | None, table: Path | None, seed: int | None, options: Mapping[str, Any]
) -> tuple[Design, Sequence[int] | None]:
    """The design, and the numbers of its runs where a table tells them."""
    import secrets

    import numpy as np

    from ...doe.designs.imported import ImportedDesign

    drawn = seed if seed is not None else secrets.randbelow(2**31)
    if drawn < 0:
        raise ValueError(f"seed is {drawn}; expected 0 or more")
    rng = np.random.default_rng(drawn)
    made = get_method(method).make(space, DesignRequest(runs, table, rng, options))
    return (made, made.runs) if isinstance(made, ImportedDesign) else (in_order(made, rng, drawn), None)


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
    """Store a design as a plan that can be fired; nothing is stored where a run is beyond the bench."""
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


def in_order(design: Design, rng: np.random.Generator, seed: int | None) -> Design:
    """The design with its treatments in order of run: heavy changes rare, the rest at random."""
    from ...doe.order import order

    return Design(design.space, design.treatments[order(design.space, design.treatments, rng)], design.method, seed)


def augment_plan(store: Store, plan: StoredPlan, runs: int, repetitions: int, seed: int, gun: GunBench) -> list[int]:
    """Add `runs` to a plan, beside what is recorded and still to do; returns their numbers."""
    import numpy as np

    from ...doe.designs.augment import augment
    from ...doe.designs.lhs import balanced

    rng = np.random.default_rng(seed)
    kept = plan.treatments("planned", "done")
    design = augment(plan.space, kept, runs, lambda space, n, fixed: balanced(space, n, rng, fixed=fixed))
    rows = in_order(design, rng, seed).rows
    first = 1 + max((run.run for run in plan.runs), default=0)
    settings = run_settings(store, plan.space, numbered(rows, range(first, first + runs)), gun)
    return extend_plan(store, plan.name, rows, repetitions=repetitions, settings=settings)
