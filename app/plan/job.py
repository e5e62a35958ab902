"""A plan: a balanced hypercube is searched for, which takes seconds to minutes, and stored as the
job ends."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from ..jobs.kind import Ending, JobForm, Kind, Result, RunningJob

if TYPE_CHECKING:
    from ...doe.order import RunOrder
    from ...doe.space import Kind as PlanKind
    from .planning import PlanDraft


@dataclass(frozen=True)
class PlanArguments:
    """What a plan is made of; `factors` is a TOML text (empty: the shipped ones), `table` a CSV to
    import, `options` those of the method.

    The seed is drawn when a plan is asked for: whoever makes it makes the same one.
    """

    name: str
    method: str = "lhs"
    kind: PlanKind = "gun"
    runs: int | None = None
    repetitions: int = 10
    seed: int | None = None
    factors: str = ""
    table: str = ""
    description: str = ""
    options: Mapping[str, str | int | float] = field(default_factory=dict)
    replicates: int = 1
    centre_points: int = 0
    order: RunOrder = "split-plot"
    blocks: int = 1

    def draft(self) -> PlanDraft:
        """The design. Raises as `planning.draft_plan`."""
        from .planning import draft_plan

        with tempfile.TemporaryDirectory(prefix="pyroshock-plan-") as scratch:
            table = Path(scratch) / "table.csv"
            table.write_text(self.table, encoding="utf-8")
            return draft_plan(
                self.method,
                self.name,
                kind=self.kind,
                factors=self.factors or None,
                runs=self.runs,
                table=table,
                repetitions=self.repetitions,
                seed=self.seed,
                description=self.description or None,
                options=self.options,
                replicates=self.replicates,
                centre_points=self.centre_points,
                order=self.order,
                blocks=self.blocks,
            )


def _do(work: RunningJob, arguments: PlanArguments) -> Ending:
    from ..common.plan_tables import plan_as_json
    from .planning import store_draft

    work.step(0, 0, "making the design")
    draft = arguments.draft()

    def ending() -> Result:
        plan = store_draft(work.store, draft)
        seed = "" if plan.seed is None else f", seed {plan.seed}"
        return Result(
            f"/plans/{quote(plan.name, safe='')}",
            f"{len(plan.runs)} runs{seed}",
            plan_as_json(plan),
        )

    return ending


def _form(arguments: PlanArguments) -> JobForm:
    names = ("name", "method", "description", "factors", "table")
    numbers = ("runs", "repetitions", "seed")
    values = {name: getattr(arguments, name) for name in (*names, *numbers)}
    fields: dict[str, str | list[str]] = {
        name: str(value) for name, value in values.items() if value not in (None, "")
    }
    fields |= {
        f"{arguments.method}.{option}": str(value) for option, value in arguments.options.items()
    }
    return JobForm(f"/plans/new?kind={arguments.kind}", "make", fields)


PLAN = Kind("plan", PlanArguments, _do, form=_form)
