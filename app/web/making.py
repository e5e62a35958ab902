"""A plan made as a job: a balanced hypercube is searched for, which takes seconds to minutes."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import select

from ...doe.plans import PlanExistsError
from ...doe.space import Kind, space_from_text
from ...schema.plans import Plan
from ...schema.session import Store
from ..planning import make_plan, plan_as_json
from .asking import signed
from .jobs import Job, Jobs, Result, Step
from .rendering import part

#: More runs than a laboratory fires in a year, and more than the search can balance in minutes.
MOST_RUNS = 2000
#: Nothing, what an address takes for a way up, and the page that makes plans.
_NO_NAMES = ("", ".", "..", "new")


@dataclass(frozen=True)
class Wanted:
    """What a plan is made of; `factors` is a TOML text (empty: the shipped ones), `table` a CSV to import."""

    name: str
    method: str = "lhs"
    kind: Kind = "gun"
    runs: int | None = None
    repetitions: int = 10
    seed: int | None = None
    factors: str = ""
    table: str = ""
    description: str = ""

    def made(self, store: Store) -> Any:
        """The stored plan. Raises as `planning.make_plan`."""
        with tempfile.TemporaryDirectory(prefix="pyroshock-plan-") as scratch:
            table = Path(scratch) / "table.csv"
            table.write_text(self.table, encoding="utf-8")
            return make_plan(
                store,
                self.method,
                self.name,
                kind=self.kind,
                factors=self.factors or None,
                runs=self.runs if self.method == "lhs" else None,
                table=table if self.method == "import" else None,
                repetitions=self.repetitions,
                seed=self.seed,
                description=self.description or None,
            )


def plan_job(jobs: Jobs, store: Store, wanted: Wanted) -> Job:
    """Queue the making of a plan. Raises `ValueError` for what would only be refused after the search."""
    _check(store, wanted)

    def work(step: Step) -> Result:
        step(0, 0, "searching for a balanced design" if wanted.method == "lhs" else "making the design")
        plan = wanted.made(signed(store, f"serve: plan {wanted.method} {wanted.name}"))
        seed = "" if plan.seed is None else f", seed {plan.seed}"
        return Result(f"/plans/{part(plan.name)}", f"{len(plan.runs)} runs{seed}", plan_as_json(plan))

    return jobs.start(f"Plan {wanted.name}", work)


def _check(store: Store, wanted: Wanted) -> None:
    if wanted.name.strip() in _NO_NAMES:
        raise ValueError(f"{wanted.name!r} cannot name a plan; expected a word or two")
    if wanted.runs is not None and not 1 <= wanted.runs <= MOST_RUNS:
        raise ValueError(f"{wanted.runs} runs; expected 1 to {MOST_RUNS}")
    if wanted.seed is not None and not 0 <= wanted.seed < 2**31:
        raise ValueError(f"seed is {wanted.seed}; expected 0 to {2**31 - 1}, or none to draw one")
    if wanted.factors:
        space_from_text(wanted.factors)
    with store.reading() as session:
        if session.scalar(select(Plan.id).where(Plan.name == wanted.name)) is not None:
            raise PlanExistsError(f"plan {wanted.name!r} is in the store already; choose another name")
