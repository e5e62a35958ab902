"""What is stored of plans: their list, and the runs of one with their states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from ...common.plan_tables import plan_as_json, run_counts, settings_in_si
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Outcome, Progress, Request, Result, ResultTable, Rows
from ..sentence import Number, Sentence, sentence

if TYPE_CHECKING:
    from ....doe.plans import StoredPlan

#: The name of a stored plan, as the first word behind the command.
PlanName = Annotated[str, Field(min_length=1, max_length=1000)]
NAMED = Presentation(positional=True, completion="plan_names")


def _list(_: Request, laboratory: Laboratory, __: Progress) -> Rows:
    from ....doe.plans import list_plans

    with laboratory.store.reading() as session:
        rows = list_plans(session)
    return Rows(rows, "no plans; make one: pyroshock plan lhs NAME --runs 105")


PLAN_LIST: Operation[Request, Rows] = Operation(
    name="plan-list",
    request=Request,
    run=_list,
    help="List the plans with their counts of runs.",
    example="pyroshock plan list",
    command=("plan", "list"),
    route=("GET", "/plans"),
    listing=True,
    absent={"form": "It changes nothing; the page /plans shows the list."},
)


class NamedPlan(Request):
    """One plan of the store."""

    name: PlanName = request_field(help="Name the plan.", presentation=NAMED)


@dataclass(frozen=True)
class PlanStatus(Result):
    """A plan with the state of each of its runs."""

    stored: StoredPlan

    def sentences(self) -> Sequence[Sentence]:
        """How many runs are done, and how many are still to do."""
        counts = {
            name: Number(name, count, "count") for name, count in run_counts(self.stored).items()
        }
        begun = "{begun} begun, {repeat} to repeat" if counts["repeat"].value else "{begun} begun"
        return (
            sentence(
                f"{{name}}: {{done}} done, {{planned}} to do ({begun}), {{discarded}} discarded",
                name=self.stored.name,
                **counts,
            ),
        )

    def tables(self) -> Sequence[ResultTable]:
        """A row for each run; the sentence has their counts."""
        rows = [
            {
                "run": run.run,
                "state": run.state,
                "recorded": f"{len(run.accepted)}/{run.repetitions}",
                **settings_in_si(run.row),
                **({"reason": run.reason} if run.reason else {}),
            }
            for run in self.stored.runs
        ]
        return (ResultTable("", rows, "no runs"),)

    def to_json(self) -> dict[str, Any]:
        """The plan with its runs in order."""
        return plan_as_json(self.stored)


def _status(request: NamedPlan, laboratory: Laboratory, _: Progress) -> PlanStatus:
    from ....doe.plans import read_plan

    with laboratory.store.reading() as session:
        return PlanStatus(read_plan(session, request.name))


PLAN_STATUS: Operation[NamedPlan, PlanStatus] = Operation(
    name="plan-status",
    request=NamedPlan,
    run=_status,
    help="Show which runs of a plan are done, still to do, or discarded.",
    example="pyroshock plan status rehearsal",
    command=("plan", "status"),
    route=("GET", "/plans/{name}"),
    absent={"form": "It changes nothing; the page of the plan shows it."},
)


def _unused(request: NamedPlan, laboratory: Laboratory) -> str:
    from ....doe.plan_deletion import check_plan_unused

    with laboratory.store.reading() as session:
        check_plan_unused(session, request.name)
    return f"plan {request.name}"


def _delete(request: NamedPlan, laboratory: Laboratory, _: Progress) -> Outcome:
    from ....doe.plan_deletion import delete_plan

    runs = delete_plan(laboratory.store, request.name)
    line = f"plan {request.name} is deleted with its {runs} runs"
    return Outcome((line,), {"name": request.name, "runs": runs}, "/plans")


PLAN_DELETE: Operation[NamedPlan, Outcome] = Operation(
    name="plan-delete",
    request=NamedPlan,
    run=_delete,
    help="Delete a plan with its runs. A plan for which something was recorded is refused.",
    example="pyroshock plan lhs autumn --runs 20\npyroshock plans delete autumn --yes",
    command=("plans", "delete"),
    route=("POST", "/plans/{name}/delete"),
    deletes=_unused,
)
