"""List the diagnoses of the store, and show one as it was reported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from ...common.number_format import percent
from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..operation import Lines, Operation, Progress, Request, Result, ResultTable, Rows
from ..sentence import Sentence
from .adopt import DiagnosisNumber, diagnosis_field
from .service import GapDiagnosis
from .stored import kept_report, kept_verdict, list_diagnoses
from .wording import spell_sets

Row = dict[str, Any]
#: So many rows are answered over a network where nobody says how many.
_PAGE = 50


class ListedDiagnoses(Request):
    """Which diagnoses are listed."""

    campaign: str | None = request_field(
        None,
        help="List the diagnoses of this campaign only.",
        presentation=Presentation(metavar="NAME", completion="campaign_names"),
    )
    after: DiagnosisNumber | None = request_field(
        None, help="List the diagnoses older than the one with this number."
    )
    limit: Annotated[int, Field(ge=1, le=500)] | None = request_field(
        None,
        help="List at most so many diagnoses, the newest first. [default: all, over a network 50]",
    )


class DiagnosisRows(Rows):
    """Rows of diagnoses, the newest first; the next page begins `after` the `id` of the last
    one."""

    def shortened(self, row: Mapping[str, Any]) -> Row:
        """A row for people: the likeliest cause with its probability, and what was adopted."""
        names = ("id", "campaign", "diagnosed_at", "simulator", "first", "probability", "adopted")
        shown = {name: row[name] for name in names if name in row}
        adopted = None if row["adopted"] is None else spell_sets(row["adopted"])
        return {
            **shown,
            "first": spell_sets(row["first"]),
            "probability": percent(row["probability"]),
            "adopted": adopted,
        }


def _list(request: ListedDiagnoses, laboratory: Laboratory, _: Progress) -> DiagnosisRows:
    with laboratory.store.reading() as session:
        usual = None if laboratory.folders is None else _PAGE
        rows = list_diagnoses(session, request.campaign, request.limit or usual, request.after)
    return DiagnosisRows(rows, "no diagnoses; make one: pyroshock diagnose CAMPAIGN")


class ShownDiagnosis(Request):
    """Which diagnosis is shown."""

    diagnosis: DiagnosisNumber = diagnosis_field("Show the diagnosis with this number.")


@dataclass(frozen=True, eq=False)
class StoredDiagnosis(Result):
    """A stored diagnosis: its report, and what it says; of one that an older version stored without
    what its page draws, the report alone, and what is missing."""

    report: dict[str, Any]
    diagnosis: GapDiagnosis | LookupError

    @property
    def complete(self) -> GapDiagnosis:
        """What it says. Raises `LookupError` where it was stored without what its page draws."""
        if isinstance(self.diagnosis, LookupError):
            raise self.diagnosis
        return self.diagnosis

    def sentences(self) -> Sequence[Sentence]:
        """As they were reported."""
        return self.complete.sentences()

    def tables(self) -> Sequence[ResultTable | Lines]:
        """As they were reported."""
        return self.complete.tables()

    def to_json(self) -> dict[str, Any]:
        """The report as `pyroshock diagnose --json` prints it."""
        return self.report


def _show(request: ShownDiagnosis, laboratory: Laboratory, _: Progress) -> StoredDiagnosis:
    number = request.diagnosis
    with laboratory.store.reading() as session:
        report = kept_report(session, number)
        try:
            return StoredDiagnosis(report, GapDiagnosis(kept_verdict(session, number), number))
        except LookupError as error:
            return StoredDiagnosis(report, error)


LIST_DIAGNOSES: Operation[ListedDiagnoses, DiagnosisRows] = Operation(
    name="list-diagnoses",
    request=ListedDiagnoses,
    run=_list,
    help="List the diagnoses, the newest first, with the most probable cause of each.",
    example="pyroshock diagnoses list --campaign slow-valve",
    command=("diagnoses", "list"),
    route=("GET", "/diagnoses"),
    listing=True,
    absent={"form": "the page /diagnoses lists them"},
)
SHOW_DIAGNOSIS: Operation[ShownDiagnosis, StoredDiagnosis] = Operation(
    name="show-diagnosis",
    request=ShownDiagnosis,
    run=_show,
    help="Show the diagnosis with number DIAGNOSIS as `pyroshock diagnose` reported it.",
    example="pyroshock diagnoses show 1",
    command=("diagnoses", "show"),
    route=("GET", "/diagnoses/{diagnosis}"),
    absent={"form": "the page /diagnoses/NUMBER shows it"},
)
