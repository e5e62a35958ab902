"""The datasets of the store: listed, shown, traced to their raw files, exported and deleted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from ....schema.person_roles import READER
from ..fields import Presentation, Seed, request_field
from ..laboratory import Laboratory
from ..operation import (
    FormPage,
    Operation,
    Outcome,
    Output,
    Progress,
    Request,
    Result,
    ResultTable,
    Rows,
)
from ..sentence import Number, Sentence, sentence
from .service import FrozenDataset

if TYPE_CHECKING:
    from ....dataset.snapshot import Snapshot
    from ...figures.figure import Figure

_READING = "its page is the answer itself, which an address shows"


class NamedDataset(Request):
    """One dataset of the store."""

    name: str = request_field(
        min_length=1,
        max_length=1000,
        help="Name the dataset, or give its hash or the beginning of it.",
        presentation=Presentation(positional=True, metavar="NAME", completion="dataset_names"),
    )


class DatasetShowing(NamedDataset):
    """A dataset, with the split of a seed."""

    seed: Seed = request_field(0, help="Set the seed of the random split.")


class DatasetTracing(NamedDataset):
    """A pulse of a dataset, or all of its recordings."""

    key: str | None = request_field(
        None,
        max_length=200,
        help="Give the key of the pulse, or its beginning.",
        presentation=Presentation(positional=True, metavar="[KEY]"),
    )


@dataclass(frozen=True)
class DatasetList(Rows):
    """The datasets, the newest last, with the pulses that were withdrawn since. `remarks` say which
    lost pulses."""

    remarks: tuple[str, ...] = ()

    def notes(self) -> Sequence[str]:
        """Datasets that lost pulses."""
        return self.remarks

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """With the beginning of the hash, and campaigns in one cell."""
        campaigns = ", ".join(row["campaigns"] or [])
        return {**row, "hash": row["hash"][:12], "campaigns": campaigns}


@dataclass(frozen=True, eq=False)
class ShownDataset(Result):
    """A dataset with its sources, its splits, and its predictors."""

    snapshot: Snapshot
    seed: int

    def sentences(self) -> Sequence[Sentence]:
        """Size and sources."""
        shown = self.to_json()
        counts = {
            name: Number(name, shown[name], "count")
            for name in ("pulses", "configurations", "treatments")
        }
        return (
            sentence(
                "The dataset {name} has {pulses} pulses of {configurations} configurations, from "
                "{campaigns}; velocity aside, its predictors tell {treatments} of them apart.",
                name=shown["name"],
                campaigns=", ".join(shown["campaigns"]),
                **counts,
            ),
        )

    def tables(self) -> Sequence[ResultTable]:
        """What was left out, splits, ranges and correlations of the predictors."""
        from .datasets import correlation_rows, range_rows

        shown = self.to_json()
        counts = {name: shown[name] for name in ("pulses", "configurations", "treatments")}
        sources = {"quality": shown["quality"], "hash": shown["hash"][:12]}
        extractions = ", ".join(key[:12] for key in shown["extractions"])
        return (
            ResultTable("Content", [{**counts, **sources, "extractions": extractions}]),
            ResultTable("Left out", shown["left_out"], "nothing was left out"),
            ResultTable("Splits", shown["splits"], "too few pulses for any split"),
            ResultTable("Predictors", range_rows(self.snapshot), "no predictors"),
            ResultTable("Correlations", correlation_rows(self.snapshot), "no predictors"),
        )

    def figures(self) -> Sequence[Figure]:
        """Correlations and values of the predictors."""
        from .dataset_figures import dataset_figure

        return (dataset_figure(self.snapshot.table),)

    def to_json(self) -> dict[str, Any]:
        """As `pyroshock dataset show --json` prints it."""
        from .datasets import snapshot_as_json

        return snapshot_as_json(self.snapshot, self.seed)

    def address(self) -> str:
        """Its page."""
        return f"/datasets/{quote(self.snapshot.name, safe='')}"


@dataclass(frozen=True)
class PulseOrigin(Result):
    """The raw file of a pulse, or all raw files of a dataset."""

    origin: Any

    def tables(self) -> Sequence[ResultTable]:
        """A row for each file, or for each fact of the pulse."""
        if isinstance(self.origin, list):
            return (ResultTable("", self.origin, "no pulses"),)
        rows = [{"of": name, "value": str(value)} for name, value in self.origin.items()]
        return (ResultTable("", rows, "nothing"),)

    def to_json(self) -> Any:
        """Facts of the pulse, or a list of files."""
        return self.origin


def _list(_: Request, laboratory: Laboratory, __: Progress) -> DatasetList:
    from ....dataset.catalog import list_snapshots, list_withdrawals

    with laboratory.store.reading() as session:
        withdrawals = list_withdrawals(session)
        rows = [
            {**row, "withdrawn": withdrawals[row["hash"]].lost if row["hash"] in withdrawals else 0}
            for row in list_snapshots(session)
        ]
    empty = "no datasets yet; freeze one: pyroshock dataset build NAME --from CAMPAIGN"
    return DatasetList(rows, empty, tuple(lost.words for lost in withdrawals.values()))


def _show(request: DatasetShowing, laboratory: Laboratory, _: Progress) -> ShownDataset:
    from ....dataset.snapshot import read_snapshot

    return ShownDataset(read_snapshot(laboratory.store, request.name), request.seed)


def _trace(request: DatasetTracing, laboratory: Laboratory, _: Progress) -> PulseOrigin:
    from ....dataset.snapshot import raw_files, read_snapshot, trace

    with laboratory.store.reading() as session:
        snapshot = read_snapshot(session, request.name)
        if request.key is None:
            return PulseOrigin(raw_files(session, snapshot))
        return PulseOrigin(asdict(trace(session, snapshot, request.key)))


def _unused(request: NamedDataset, laboratory: Laboratory) -> str:
    from .deletion import check_dataset_unused

    check_dataset_unused(laboratory.store, laboratory.db, request.name)
    return f"dataset {request.name}"


def _delete(request: NamedDataset, laboratory: Laboratory, _: Progress) -> Outcome:
    from .deletion import delete_dataset

    delete_dataset(laboratory.store, laboratory.db, request.name)
    data = {"name": request.name}
    return Outcome((f"dataset {request.name} is deleted",), data, "/datasets")


def _export(request: NamedDataset, laboratory: Laboratory, _: Progress) -> FrozenDataset:
    from ....dataset.snapshot import read_snapshot

    return FrozenDataset(read_snapshot(laboratory.store, request.name))


def _write(dataset: FrozenDataset, path: Path) -> None:
    from .datasets import export_snapshot

    export_snapshot(dataset.snapshot, path)


DATASET_LIST = Operation(
    name="dataset-list",
    request=Request,
    run=_list,
    help="List the datasets with their name, hash, pulses and campaigns.",
    example="pyroshock dataset list",
    command=("dataset", "list"),
    route=("GET", "/datasets"),
    listing=True,
    absent={"form": _READING},
)
DATASET_SHOW = Operation(
    name="dataset-show",
    request=DatasetShowing,
    run=_show,
    help="""Show a dataset, given by name or hash: its sources, its splits, and the ranges and
    correlations of its predictors.""",
    example="pyroshock dataset show rehearsal-pulses --plot pulses.png",
    command=("dataset", "show"),
    route=("GET", "/datasets/{name}"),
    outputs=(Output("plot", "Draw correlations and values into FILE.png.", Result.write_figure),),
    absent={"form": _READING},
)
DATASET_TRACE = Operation(
    name="dataset-trace",
    request=DatasetTracing,
    run=_trace,
    help="""Tell from which raw file a pulse of a dataset comes. KEY is the key of the pulse, or its
    beginning; without KEY, all files are listed.""",
    example="pyroshock dataset trace rehearsal-pulses",
    command=("dataset", "trace"),
    route=("GET", "/datasets/{name}/trace"),
    absent={"form": "the page of the dataset lists its files"},
)
DATASET_EXPORT = Operation(
    name="dataset-export",
    role=READER,
    unrecorded=True,
    request=NamedDataset,
    run=_export,
    help="""Write a dataset to a file, with a row per pulse: its key, predictors, figures and points
    of force.""",
    example="pyroshock dataset export rehearsal-pulses --out pulses.parquet",
    command=("dataset", "export"),
    outputs=(
        Output(
            "out",
            "Write to FILE.csv or FILE.parquet.",
            _write,
            (".csv", ".parquet"),
            in_place_of_tables=True,
            required=True,
        ),
    ),
    absent={
        "json": "it writes a file of the machine that it runs on",
        "form": "it writes a file of the machine that it runs on",
        "python": "the frame of a dataset has its rows: store.dataset(name).to_frame()",
    },
)
DATASET_DELETE = Operation(
    name="dataset-delete",
    request=NamedDataset,
    run=_delete,
    help="""Delete a dataset, given by name or hash; its pulses stay with their campaigns.

    A dataset on which registered models were trained is refused: their figures could no longer be
    computed again.""",
    example="""pyroshock dataset build autumn --from slow-valve
pyroshock datasets delete autumn --yes""",
    command=("datasets", "delete"),
    route=("POST", "/datasets/{name}/delete"),
    deletes=_unused,
    form=FormPage("/datasets/{name}/delete", "delete", "/datasets/{name}/delete"),
)
