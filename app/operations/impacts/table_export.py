"""Tables and series of the store as a file for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import model_validator

from ....schema.person_roles import READER
from ..fields import Names, Presentation, request_field
from ..laboratory import Laboratory
from ..machine_paths import NewFile
from ..operation import Operation, Progress, Result
from .listing import Selection


class TableExport(Selection):
    """A table of the store, and which of its rows and columns are written."""

    what: Literal["impacts", "shots", "pulses", "channel-figures", "series"] = request_field(
        help="Choose what is written.", presentation=Presentation(positional=True)
    )
    out: NewFile | None = request_field(
        None,
        help="Write to FILE.csv, FILE.parquet or FILE.json. The option is required.",
        presentation=Presentation(metavar="FILE"),
    )
    recording: str | None = request_field(
        None,
        max_length=4000,
        help="Export the series of this recording only, given by its path in the campaign folder.",
        presentation=Presentation(metavar="PATH"),
    )
    columns: Names = request_field(
        (),
        max_length=1000,
        help="Write only these columns, in this order. Repeat the option, or give a list: a,b. "
        "[default: all that the selection has]",
        presentation=Presentation(metavar="A,B,…"),
    )
    skip_damaged: bool = request_field(False, help="Leave out damaged series, and name them.")

    @model_validator(mode="after")
    def _selects_what_it_has(self) -> TableExport:
        if self.what == "series" and self.where:
            raise ValueError("--where does not filter series; choose a --campaign or a --recording")
        if self.what != "series" and self.recording is not None:
            raise ValueError("--recording goes with series; filter other tables with --where")
        return self


@dataclass(frozen=True)
class ExportedTable(Result):
    """A file, its rows, and the series that were left out."""

    out: Path
    rows: int
    left_out: tuple[str, ...]
    campaign: str | None

    def notes(self) -> Sequence[str]:
        """What was left out, and how many rows were written."""
        return (
            *(f"left out: {column}" for column in self.left_out),
            f"{self.rows} rows written: {self.out}",
        )

    def to_json(self) -> dict[str, Any]:
        """The same as plain data."""
        return {"file": str(self.out), "rows": self.rows, "left_out": list(self.left_out)}

    def next_command(self) -> Sequence[str]:
        """A report of the campaign."""
        campaign = self.campaign
        return () if campaign is None else ("report", campaign, "--out", f"{campaign}.html")


def _has_place(request: TableExport, _: Laboratory) -> None:
    if request.out is None:
        raise ValueError("--out is missing; expected the path of a file")


def _export(request: TableExport, laboratory: Laboratory, _: Progress) -> ExportedTable:
    from .export import export_table

    assert request.out is not None
    left_out: list[str] = []
    with laboratory.store.reading() as session:
        rows = export_table(
            session,
            request.what,
            request.out,
            request.campaign,
            request.conditions(),
            request.recording,
            left_out if request.skip_damaged else None,
            request.columns,
        )
    return ExportedTable(request.out, rows, tuple(left_out), request.campaign)


EXPORT: Operation[TableExport, ExportedTable] = Operation(
    name="export",
    role=READER,
    unrecorded=True,
    request=TableExport,
    run=_export,
    check=_has_place,
    help="""Write impacts, shots, pulses, figures of the acceleration channels, or series to a file.

Pulses are those in use, with their points of force. Series are in SI units. A factor that no
selected impact has gets no column.""",
    example="""pyroshock export impacts --out impacts.csv --columns run,tip_material,peak_force_n
pyroshock export series --campaign rehearsal --recording recordings/0001-01.h5 \\
    --out 0001-01.parquet""",
    writes_csv=True,
    label=lambda request: request.what,
    absent={
        "json": "It writes a file of the machine that it runs on.",
        "form": "The page of a campaign sends the file, for which its address asks.",
    },
)
