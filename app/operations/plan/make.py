"""Make a plan: a design by one of the methods of `doe.designs.methods`, put in order, held against
the limits of the bench, and stored."""

from __future__ import annotations

import secrets
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field, create_model, model_validator

from ....doe.designs.methods import METHODS, DesignMethod, Option
from ....doe.space import space_from_form
from ....files.toml_text import read_toml_text
from ....schema.person_roles import ENGINEER
from ...common.plan_tables import write_table
from ..faults import FieldError
from ..fields import Presentation, Seed, TextFile, pairs, request_field, text_file
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Output, Progress, Request

if TYPE_CHECKING:
    from .planning import PlanDraft
    from .service import PlannedDesign

#: More runs than a laboratory fires in a year, and more than the search can balance in minutes.
MOST_RUNS = 2000
#: Runs of the design of the thesis, which its table A.1 lists.
THESIS_RUNS = 105
#: What an address takes for a way up, and the page that makes plans.
_NO_NAMES = (".", "..", "new")


def _plan_name(name: str) -> str:
    if name in _NO_NAMES:
        raise ValueError(f"name is {name!r}, which cannot name a plan; expected a word or two")
    return name


def _drawn_seed(seed: Any) -> Any:
    """A seed where none is given, so that a job that is done again makes the same plan."""
    return secrets.randbelow(2**31) if seed in (None, "") else seed


def _range(field: str, factor: str, value: Any) -> tuple[Any, ...]:
    """Low, high and step, of a sequence or of LOW:HIGH[:STEP]; texts with units stay texts."""
    parts = [part.strip() for part in value.split(":")] if isinstance(value, str) else value
    if not isinstance(parts, Sequence) or len(parts) not in (2, 3):
        raise ValueError(
            f"{field} is '{factor}={value}'; expected such as tank_pressure_bar=0.8:6:0.05"
        )
    try:
        return tuple(float(part) for part in parts)
    except (TypeError, ValueError):
        return tuple(parts)


class Planning(Request):
    """What a plan of any method is made of."""

    method: str
    name: Annotated[str, AfterValidator(_plan_name)] = request_field(
        min_length=1,
        max_length=200,
        help="Name the plan.",
        presentation=Presentation(positional=True),
    )
    kind: Literal["gun", "hammer"] = request_field(
        "gun", help="Take the factors of this kind of bench."
    )
    factors: text_file(200_000, read_toml_text) | None = request_field(  # type: ignore[valid-type]
        None,
        help="Read your own factors from a TOML file.",
        presentation=Presentation(metavar="FILE.toml"),
    )
    ranges: pairs(_range, Any) = request_field(  # type: ignore[valid-type]
        {},
        help="Make a factor continuous over a range, in the unit of its column.",
        example="tank_pressure_bar=0.8:6:0.05",
        presentation=Presentation(metavar="COLUMN=LOW:HIGH[:STEP]", option="range"),
    )
    repetitions: Annotated[int, Field(ge=1, le=1000)] = request_field(
        10, help="Set the hits or shots of each run."
    )
    seed: Annotated[Seed, BeforeValidator(_drawn_seed)] = request_field(
        help="Set the seed: the same seed gives the same plan. [default: drawn and reported]",
        default_factory=lambda: _drawn_seed(None),
    )
    gun: Path | None = request_field(
        None,
        help="Take the limits of the gun of this campaign folder.",
        presentation=Presentation(metavar="FOLDER"),
    )
    description: str = request_field("", max_length=10_000, help="Describe the plan in a sentence.")

    @model_validator(mode="before")
    @classmethod
    def _with_options(cls, values: Any) -> Any:
        """Scripts may give the options of the method as a mapping `options`."""
        if isinstance(values, Mapping) and isinstance(values.get("options"), Mapping):
            others = {name: value for name, value in values.items() if name != "options"}
            return {**others, **values["options"]}
        return values

    def draft(self) -> PlanDraft:
        """The design. Raises as `planning.draft_plan`."""
        from .planning import draft_plan, range_in_column

        options = {
            option.name: getattr(self, option.name) for option in METHODS[self.method].options
        }
        table: TextFile | None = getattr(self, "table", None)
        with ExitStack() as stack:
            return draft_plan(
                self.method,
                self.name,
                kind=self.kind,
                factors=None if self.factors is None else self.factors.text,
                runs=getattr(self, "runs", None),
                table=None if table is None else stack.enter_context(table.as_path()),
                repetitions=self.repetitions,
                seed=self.seed,
                gun=self.gun,
                description=self.description or None,
                options=options,
                ranges={
                    name: range_in_column(name, limits) for name, limits in self.ranges.items()
                },
                **{
                    name: getattr(self, name)
                    for name in ("replicates", "centre_points", "order", "blocks")
                    if hasattr(self, name)
                },
            )


class OrderedPlanning(Planning):
    """What a plan is made of whose runs and their order are made here."""

    order: Literal["split-plot", "random"] = request_field(
        "split-plot",
        help="Choose the order of runs: a split plot changes heavy parts seldom; random is full "
        "randomisation.",
    )
    blocks: Annotated[int, Field(ge=1, le=100)] = request_field(
        1,
        help="Visit every heavy set-up this many times, forwards and backwards in turn, so that a "
        "drift of the bench can be told from its effect.",
    )
    replicates: Annotated[int, Field(ge=1, le=100)] = request_field(
        1, help="Plan every treatment this many times, as runs of their own."
    )

    @model_validator(mode="after")
    def _blocks_in_order(self) -> OrderedPlanning:
        if self.order == "random" and self.blocks > 1:
            raise FieldError(
                "blocks",
                f"blocks is {self.blocks} in random order; expected 1, or the order of a split "
                "plot",
            )
        return self


def _request_of(name: str, method: DesignMethod) -> type[Planning]:
    """The request of one method: what it takes, its options, and what all have."""
    fields: dict[str, Any] = {"method": (Literal[name], name)}
    if "runs" in method.takes:
        runs = request_field(THESIS_RUNS, ge=1, le=MOST_RUNS, help="Set the number of runs.")
        fields["runs"] = (int, runs)
    if "table" in method.takes:
        table = request_field(
            help="Read the design from this CSV table: a column for each factor, a row a run.",
            presentation=Presentation(positional=True, metavar="TABLE", lines=10),
        )
        fields["table"] = (text_file(800_000), table)
    fields |= {option.name: _field_of(option) for option in method.options}
    if method.centre_points:
        centre_points = request_field(
            0,
            ge=0,
            le=200,
            help="Add this many runs in the middle of all ordered factors, which show a curved "
            "response.",
        )
        fields["centre_points"] = (int, centre_points)
    base = Planning if "table" in method.takes else OrderedPlanning
    title = "".join(part.capitalize() for part in name.split("-"))
    request = create_model(f"{title}Planning", __base__=base, __doc__=method.help, **fields)
    request.example_command = "\n".join(  # type: ignore[attr-defined]
        f"pyroshock {line}" for line in method.example.splitlines()
    )
    return request


def _field_of(option: Option) -> tuple[Any, Any]:
    kind: Any = Literal[option.choices] if option.choices else option.kind
    if option.default is None:
        kind = kind | None
    return kind, request_field(option.default, help=option.help)


#: Method of design -> its request.
REQUESTS: Mapping[str, type[Planning]] = {
    name: _request_of(name, method) for name, method in METHODS.items()
}


def check(request: Planning, laboratory: Laboratory) -> None:
    """Raises `ValueError` for factors that cannot be used, and for a name in use."""
    from sqlalchemy import select

    from ....doe.plans import PlanExistsError
    from ....schema.campaigns import Plan

    if request.factors is not None:
        space_from_form(request.factors.text, str(request.factors.path or "factors"))
    with laboratory.store.reading() as session:
        if session.scalar(select(Plan.id).where(Plan.name == request.name)) is not None:
            raise PlanExistsError(
                f"plan {request.name!r} is in the store already; choose another name"
            )


def _run(request: Planning, _: Laboratory, progress: Progress) -> PlanDraft:
    progress(0, 0, "making the design")
    return request.draft()


def _keep(draft: PlanDraft, laboratory: Laboratory) -> PlannedDesign:
    from .planning import store_draft
    from .service import PlannedDesign

    return PlannedDesign(store_draft(laboratory.store, draft))


PLAN: Operation[Planning, PlannedDesign] = Operation(
    name="plan",
    role=ENGINEER,
    request=Planning,
    run=_run,
    keep=_keep,
    check=check,
    help="Make a plan of a campaign by one of the methods of design, and store it.",
    command=("plan",),
    route=("POST", "/plans"),
    variants=tuple(REQUESTS.values()),
    long=True,
    creates_store=True,
    outputs=(
        Output(
            "out",
            "Write the table of runs to FILE as CSV.",
            lambda planned, path: write_table(planned.stored, path),
            (".csv",),
            in_place_of_tables=True,
        ),
    ),
    form=FormPage("/plans/new?kind={kind}", "make", "/plans"),
)
