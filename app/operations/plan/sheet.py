"""The run sheet of a plan: what is fired in which order, to be ticked off at the bench."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ....schema.person_roles import READER
from ...common.plan_tables import plan_as_json
from ..laboratory import Laboratory
from ..operation import Operation, Output, Progress, Result
from .status import NamedPlan

if TYPE_CHECKING:
    from ....doe.plans import StoredPlan

_BY_ADDRESS = "The addresses /plans/NAME/sheet.csv, .html and .xlsx give the file."


@dataclass(frozen=True)
class RunSheet(Result):
    """A plan, to be written as a run sheet."""

    stored: StoredPlan

    def to_json(self) -> dict[str, Any]:
        """The plan with its runs in order."""
        return plan_as_json(self.stored)

    def next_command(self) -> Sequence[str]:
        """The folder of the campaign that works the plan off."""
        name = self.stored.name
        return ("campaigns", "init", name, "--kind", self.stored.space.kind, "--plan", name)


def _read(request: NamedPlan, laboratory: Laboratory, _: Progress) -> RunSheet:
    from ....doe.plans import read_plan

    with laboratory.store.reading() as session:
        return RunSheet(read_plan(session, request.name))


def _write(sheet: RunSheet, path: Path) -> None:
    from ....doe.sheet import write_sheet

    write_sheet(sheet.stored, path)


PLAN_SHEET: Operation[NamedPlan, RunSheet] = Operation(
    name="plan-sheet",
    role=READER,
    unrecorded=True,
    request=NamedPlan,
    run=_read,
    help="Write the run sheet for the bench: the runs in their order, with a box to tick for each.",
    example="pyroshock plan sheet rehearsal --out rehearsal.html",
    command=("plan", "sheet"),
    outputs=(
        Output(
            "out",
            "Write to this file; its ending chooses the format.",
            _write,
            (".html", ".csv", ".xlsx"),
            in_place_of_tables=True,
            required=True,
        ),
    ),
    absent={"json": _BY_ADDRESS, "form": _BY_ADDRESS},
)
