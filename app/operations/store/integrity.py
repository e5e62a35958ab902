"""`db check`: whether everything that the store holds is as it was stored."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from ....schema.person_roles import ENGINEER
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..machine_paths import CampaignFolder
from ..operation import Operation, Progress, Request, Result, ResultTable

if TYPE_CHECKING:
    from ....schema.integrity.findings import IntegrityFinding

#: So many findings stand in the words of a job.
_MOST_WORDS = 10


class StoreCheck(Request):
    """What of a store is checked."""

    campaign: str | None = request_field(
        None,
        help="Check the recordings, impacts and pulses of this campaign only.",
        presentation=Presentation(metavar="NAME", completion="campaign_names"),
    )
    fast: bool = request_field(
        False, help="Count and compare rows, but read no series, pulse, dataset or model."
    )
    repair: CampaignFolder | None = request_field(
        None,
        help="First read damaged series again from this campaign folder.",
        presentation=Presentation(metavar="FOLDER"),
    )


@dataclass(frozen=True)
class CheckedStore(Result):
    """What is wrong with the store at `place`; `remarks` are about series that were read again,
    and about datasets that lost pulses to a deletion."""

    place: str
    findings: tuple[IntegrityFinding, ...]
    remarks: tuple[str, ...]

    @property
    def exit_code(self) -> int:
        """1 where something is wrong."""
        return 1 if self.findings else 0

    def notes(self) -> Sequence[str]:
        """Whether the store is sound."""
        count = len(self.findings)
        verdict = f"{self.place}: {count} findings" if count else f"{self.place} is sound"
        return (*self.remarks, verdict)

    def text(self) -> str:
        """A line for each finding."""
        return "\n".join(map(str, self.findings))

    def tables(self) -> Sequence[ResultTable]:
        """The findings, where there are any."""
        rows = [finding.as_json() for finding in self.findings]
        return (ResultTable("findings", rows),) if rows else ()

    def to_json(self) -> dict[str, Any]:
        """Whether it is sound, and what is wrong where."""
        return {
            "sound": not self.findings,
            "findings": [finding.as_json() for finding in self.findings],
        }

    def summary(self) -> str:
        """The verdict, with the first findings."""
        return "; ".join([*self.notes(), *map(str, self.findings[:_MOST_WORDS])])


def _check(request: StoreCheck, laboratory: Laboratory, progress: Progress) -> CheckedStore:
    from ....ingest.storing.series_repair import repair_series
    from ....schema.engine import describe
    from .check import datasets_without_source, findings_of

    store = laboratory.store
    remarks: list[str] = []
    if request.repair is not None:
        report = repair_series(store, request.repair.readable(laboratory))
        name = report.campaign
        remarks += [f"mended: {name}, {series}" for series in report.mended]
        remarks += [
            f"left as it is: {name}, {series}: {why}" for series, why in report.left.items()
        ]
    findings = tuple(
        findings_of(store, laboratory.db, request.campaign, fast=request.fast, progress=progress)
    )
    if not request.fast and request.campaign is None:
        with store.reading() as session:
            remarks += datasets_without_source(session)
    return CheckedStore(describe(store.engine), findings, tuple(remarks))


DB_CHECK: Operation[StoreCheck, CheckedStore] = Operation(
    name="db-check",
    role=ENGINEER,
    request=StoreCheck,
    run=_check,
    help="""Verify hashes, references and counts of the store. The exit code is 1 if anything is
wrong, and it is named.

Every series is decoded and compared with the SHA-256 of what was recorded. Every reference must
lead to a row, every dataset must give its hash, and every registered model must load.""",
    example="pyroshock db check --fast\npyroshock db check --campaign rehearsal",
    command=("db", "check"),
    route=("POST", "/store/check"),
    long=True,
    steps="samples",
    on_this_machine=True,
    label=lambda request: request.campaign or "",
)
