"""The quality of a plan as an operation: its verdict, its figures, and another plan beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, Field, ValidationInfo

from ....doe.designs.imported import read_table
from ....doe.merit.model_terms import USUAL_EFFECT
from ....doe.merit.verdict import Judgement
from ....doe.plans import read_plan
from ....doe.space import Space
from ..fields import Presentation, TextFile, request_field, source_of
from ..laboratory import Laboratory
from ..operation import Operation, Output, Progress, Result, ResultTable
from ..sentence import Sentence
from .quality import Designs, figures_as_json, judged_designs, tables, verdict_lines
from .status import NamedPlan

if TYPE_CHECKING:
    from ...figures.figure import Figure, PlotGrid


def _plan_or_table(value: Any, info: ValidationInfo) -> Any:
    """A path of a table on this machine, given by whoever works here, is read; all else is the name
    of a plan."""
    if isinstance(value, str | Path) and source_of(info) in ("command", "python"):
        path = Path(value)
        if path.is_file():
            return TextFile(name=str(path), text=path.read_text(encoding="utf-8-sig"), path=path)
    return str(value) if isinstance(value, Path) else value


class PlanQualityRequest(NamedPlan):
    """A plan that is judged, and what it is compared with."""

    against: Annotated[TextFile | str | None, BeforeValidator(_plan_or_table)] = request_field(
        None,
        help="Compare with another plan, or with a table (CSV) of the same factors.",
        presentation=Presentation(metavar="OTHER", completion="plan_names"),
    )
    effect: Annotated[float, Field(gt=0, le=1000)] = request_field(
        USUAL_EFFECT,
        help="Show the power for an effect of this many standard deviations of a run.",
    )


@dataclass(frozen=True)
class JudgedPlan(Result):
    """One design or two, judged. `designs` are their treatments by name."""

    space: Space
    designs: Designs
    judged: Mapping[str, Judgement]

    def sentences(self) -> Sequence[Sentence]:
        """The verdict of each design, with its reasons and their cures."""
        return tuple(map(Sentence, verdict_lines(self.judged)))

    def tables(self) -> Sequence[ResultTable]:
        """Figures, power, confounding with time, and counts of levels."""
        return tuple(
            ResultTable(title, rows, "nothing to show")
            for title, rows in tables(self.space, self.judged)
        )

    def figure(self) -> PlotGrid:
        """The designs beside each other, a column each."""
        from .figures import quality_figure

        return quality_figure(self.space, self.designs)

    def figures(self) -> Sequence[Figure]:
        """The designs beside each other."""
        return (self.figure(),)

    def to_json(self) -> Any:
        """Figures of one design, or a list of two."""
        return figures_as_json(self.space, self.judged)


def _judge(request: PlanQualityRequest, laboratory: Laboratory, _: Progress) -> JudgedPlan:
    with laboratory.store.reading() as session:
        plan = read_plan(session, request.name)
        designs = {request.name: plan.treatments("planned", "done")}
        if isinstance(request.against, TextFile):
            with request.against.as_path() as path:
                designs[path.stem] = read_table(path, plan.space).treatments
        elif request.against:
            other = read_plan(session, request.against)
            if other.space.axes != plan.space.axes:
                raise ValueError(
                    f"against is {request.against!r}, a plan of other factors than "
                    f"{request.name!r}; only like can be compared"
                )
            designs[request.against] = other.treatments("planned", "done")
    return JudgedPlan(plan.space, designs, judged_designs(plan.space, designs, request.effect))


PLAN_QUALITY: Operation[PlanQualityRequest, JudgedPlan] = Operation(
    name="plan-quality",
    request=PlanQualityRequest,
    run=_judge,
    help="""Say whether a plan is good, with the reasons and their cures, and measure it: balance of
levels, pairs and triples, space filling, power, changeovers, and confounding with other effects and
with time.

The figures stand between the best that any plan of so many runs can have, where a bound is known,
and the median of plans drawn at random. The power is the chance that the effect of a factor is
seen, in a model of all main effects at a significance of 5 %.""",
    example="pyroshock plan quality rehearsal --against slow-valve --plot quality.png",
    command=("plan", "quality"),
    route=("GET", "/plans/{name}/quality"),
    outputs=(
        Output(
            "plot",
            "Draw the quality of the plan into FILE.png.",
            Result.write_figure,
            (".png", ".svg", ".pdf"),
        ),
    ),
    absent={"form": "It changes nothing; the page of the plan shows it."},
)
