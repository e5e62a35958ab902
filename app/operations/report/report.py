"""Report a campaign, a diagnosis or a model as one file to send, print or keep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from ....schema.person_roles import READER
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Output, Progress, Request, Result

if TYPE_CHECKING:
    from ...documents.document import Document


class ReportRequest(Request):
    """What a report is about."""

    subject: Annotated[str, Field(min_length=1, max_length=1000)] = request_field(
        help="Name a campaign, a diagnosis as diagnosis:ID or diagnosis:CAMPAIGN, or a model as "
        "NAME@VERSION.",
        presentation=Presentation(
            positional=True, metavar="CAMPAIGN|DIAGNOSIS|MODEL", completion="subject_names"
        ),
    )


@dataclass(frozen=True, eq=False)
class WrittenReport(Result):
    """A report, and the word that it was asked for with."""

    subject: str
    document: Document

    def to_json(self) -> dict[str, Any]:
        """What it is about, and what it tells first."""
        document = self.document
        facts = {"kind": document.kind, "title": document.title, "lead": document.lead}
        return {**facts, "facts": dict(document.facts)}

    def next_command(self) -> Sequence[str]:
        """A diagnosis leads to runs that tell its causes apart, a model to its rivals, a campaign
        to a copy of it."""
        kind, _, name = self.subject.rpartition(":")
        if kind == "diagnosis":
            return ("diagnoses", "list") if name.isdecimal() else ("plan", "discriminate", name)
        return ("compare",) if "@" in name else ("db", "export", name, "--out", f"{name}.pyroshock")


def _run(request: ReportRequest, laboratory: Laboratory, _: Progress) -> WrittenReport:
    from . import dispatch

    document = dispatch.report_on(laboratory.store, laboratory.db, request.subject)
    return WrittenReport(request.subject, document)


def _check_ending(path: Path) -> None:
    from ...documents.write import check_ending

    check_ending(path)


def _write(report: WrittenReport, path: Path) -> None:
    from ...documents.write import write_report

    write_report(report.document, path)


_IS_A_FILE = "The pages of reports give the file."

REPORT: Operation[ReportRequest, WrittenReport] = Operation(
    name="report",
    role=READER,
    unrecorded=True,
    request=ReportRequest,
    run=_run,
    help="""Write a report as one file that needs no other file: a page (.html) or a PDF.

A campaign is given by its name, a diagnosis by diagnosis:ID or diagnosis:CAMPAIGN (its newest), a
model by NAME@VERSION or models:/NAME@VERSION. A file of the same name is replaced.""",
    example="pyroshock report rehearsal --out rehearsal.html\n"
    "pyroshock report diagnosis:slow-valve --out gap.pdf\n"
    "pyroshock report gp@1 --out gp.pdf",
    outputs=(
        Output(
            "out",
            "Write to FILE.html or FILE.pdf.",
            _write,
            (".html", ".pdf"),
            check=_check_ending,
            required=True,
        ),
    ),
    label=lambda request: f"on {request.subject}",
    absent={"json": _IS_A_FILE, "form": _IS_A_FILE},
)
