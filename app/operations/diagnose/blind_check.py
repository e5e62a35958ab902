"""Score the diagnosis on virtual campaigns whose cause is withheld from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from ....schema.person_roles import ENGINEER
from ...common.number_format import finite
from ..fields import Names, Presentation, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Progress, Request, Result

if TYPE_CHECKING:
    from ....validation.report import Pool, Report


def _known_tiers(tiers: Sequence[str], info: ValidationInfo) -> tuple[str, ...]:
    """Tiers by name, or by the name of several."""
    if not tiers:
        return ()
    from ....validation.case_plan import GROUPS, TIERS

    names: list[str] = []
    for tier in tiers:
        if tier not in TIERS and tier not in GROUPS:
            raise ValueError(
                f"{info.field_name} is {tier!r}; expected one of {', '.join([*TIERS, *GROUPS])}"
            )
        names += GROUPS.get(tier, (tier,))
    return tuple(names)


class BlindCheckRequest(Request):
    """How many campaigns are drawn, of which kinds, and what is computed of them."""

    cases: Annotated[int, Field(ge=1, le=100_000)] | None = request_field(
        None, help="Set the number of campaigns of each tier."
    )
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] | None = request_field(
        None, help="Set the seed of the cases. [default: that of the split]"
    )
    tiers: Annotated[Names, AfterValidator(_known_tiers)] = request_field(
        (),
        help="Take only this tier. Repeat the option, or give a list: a,b. [default: all]",
        presentation=Presentation(metavar="NAME", option="tier"),
    )
    kinds: Names = request_field(
        (),
        help="Take only this kind of campaign, where a tier has several. Repeat the option, or "
        "give a list: a,b.",
        presentation=Presentation(metavar="NAME", option="kind"),
    )
    split: Literal["development", "calibration", "sealed"] = request_field(
        "sealed", help="Choose which families, laws and seeds may be drawn."
    )
    time_limit: Annotated[float, Field(ge=1)] = request_field(
        900.0, help="Stop a case after this number of seconds."
    )
    folder: Path | None = request_field(
        None,
        help="Keep the answers in this folder, and continue those that are there.",
        presentation=Presentation(metavar="FOLDER"),
    )
    pool: tuple[Path, ...] = request_field(
        (),
        help="Run no new check, but make one table of the answers kept here, from several nights "
        "or machines. The option can be repeated.",
        presentation=Presentation(metavar="FOLDER"),
    )
    baselines: bool = request_field(
        True, help="Show simpler methods beside the diagnosis, or leave them out."
    )
    shrinkage: bool = request_field(
        True,
        help="Compute the reduction of the gap, which takes a third of the time, or leave it out.",
    )

    @model_validator(mode="after")
    def _has_cases(self) -> BlindCheckRequest:
        if self.cases is None and not self.pool:
            raise ValueError(
                "cases is missing; expected a whole number from 1, or a pool of finished checks"
            )
        return self


@dataclass(frozen=True, eq=False)
class BlindCheckScore(Result):
    """How often the diagnosis was right, by tier; `report` has the figures."""

    report: Report | Pool

    def text(self) -> str:
        """Tables of the figures."""
        return self.report.text()

    def to_json(self) -> dict[str, Any]:
        """The figures, with the hashes of the labels that were published before."""
        data: dict[str, Any] = finite(self.report.as_json())
        return data

    def summary(self) -> str:
        """How many campaigns were answered."""
        tiers = self.report.tiers
        return f"{tiers[-1].n} campaigns" if tiers else "no campaigns"


def check(request: BlindCheckRequest, laboratory: Laboratory) -> None:
    """Raises `ValueError` over a network for a folder that may not be named there."""
    if laboratory.folders is None:
        return
    for path in filter(None, (request.folder, *request.pool)):
        if not any(path.resolve().is_relative_to(own.resolve()) for own in laboratory.folders):
            allowed = ", ".join(map(str, laboratory.folders)) or "none"
            raise ValueError(f"folder is '{path}'; expected a folder below: {allowed}")


def _run(request: BlindCheckRequest, laboratory: Laboratory, progress: Progress) -> BlindCheckScore:
    check(request, laboratory)
    if request.pool:
        return BlindCheckScore(_pooled(request.pool))
    from ....validation.blind_check import OPTIONS, run
    from ....validation.case_plan import SEEDS, TIERS

    assert request.cases is not None
    return BlindCheckScore(
        run(
            request.cases,
            SEEDS[request.split] if request.seed is None else request.seed,
            request.tiers or tuple(TIERS),
            executor=laboratory.executor,
            folder=request.folder,
            progress=progress,
            options=replace(OPTIONS, shrink=request.shrinkage),
            baselines=request.baselines,
            oracle=request.shrinkage,
            split=request.split,
            kinds=request.kinds,
            patience_s=request.time_limit,
        )
    )


def _pooled(folders: Sequence[Path]) -> Pool:
    """Of folders, or of the files with scored rows themselves."""
    from ....validation.bench_figures import bench_tables
    from ....validation.case_plan import BENCHES
    from ....validation.cause_figures import cause_tables
    from ....validation.report import SCORED, Pool, pooled
    from ....validation.tally import kinds, tables

    checks, rows = pooled([path if path.is_file() else path / SCORED for path in folders])
    names = tuple(BENCHES)
    return Pool(
        tuple(checks),
        tables(rows),
        kinds(rows),
        bench_tables(rows, names),
        cause_tables(rows, names),
    )


BLIND_CHECK: Operation[BlindCheckRequest, BlindCheckScore] = Operation(
    name="blind-check",
    role=ENGINEER,
    request=BlindCheckRequest,
    run=_run,
    check=check,
    help="Score the diagnosis on virtual campaigns whose effects are drawn and sealed before.\n\n"
    "The virtual bench records the campaigns, and their folders are diagnosed. Salted hashes of "
    "the labels are published before the first diagnosis (in FOLDER, and in the JSON), and the "
    "labels are opened after the last one.",
    example="pyroshock blind-check --cases 8 --seed 7 --tier realistic --split development",
    long=True,
    steps="%",
    uses_store=False,
    workers="Set the number of processes.",
    label=lambda request: f"of {request.cases} cases" if request.cases else "of finished checks",
)
