"""The datasets of the store: listed, shown, and traced to the raw files of their pulses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from ..fields import Presentation, Seed, request_field
from ..laboratory import Laboratory
from ..operation import Operation, Output, Progress, Request, Result, Table
from ..sentence import Number, Sentence, sentence

if TYPE_CHECKING:
    from ....dataset.snapshot import Snapshot

_READING = "its page is the answer itself, which an address shows"


class DatasetListing(Request):
    """All datasets."""


class DatasetShowing(Request):
    """A dataset."""

    name: str = request_field(
        min_length=1,
        max_length=1000,
        help="Name the dataset, or give its hash or the beginning of it.",
        presentation=Presentation(positional=True, metavar="NAME", completion="dataset_names"),
    )
    seed: Seed = request_field(0, help="Set the seed of the random split.")


class DatasetTracing(Request):
    """A pulse of a dataset, or all of its recordings."""

    name: str = request_field(
        min_length=1,
        max_length=1000,
        help="Name the dataset, or give its hash or the beginning of it.",
        presentation=Presentation(positional=True, metavar="NAME", completion="dataset_names"),
    )
    key: str | None = request_field(
        None,
        max_length=200,
        help="Give the key of the pulse, or its beginning.",
        presentation=Presentation(positional=True, metavar="[KEY]"),
    )


@dataclass(frozen=True)
class DatasetList(Result):
    """The datasets, the newest last, with the pulses that were withdrawn since. `remarks` say which
    lost pulses."""

    rows: tuple[dict[str, Any], ...]
    remarks: tuple[str, ...]

    def notes(self) -> Sequence[str]:
        """Datasets that lost pulses."""
        return self.remarks

    def to_json(self) -> list[dict[str, Any]]:
        """A row for each."""
        return list(self.rows)


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

    def tables(self) -> Sequence[Table]:
        """What was left out, splits, ranges and correlations of the predictors."""
        from .datasets import correlation_rows, range_rows

        shown = self.to_json()
        counts = {name: shown[name] for name in ("pulses", "configurations", "treatments")}
        sources = {"quality": shown["quality"], "hash": shown["hash"][:12]}
        extractions = ", ".join(key[:12] for key in shown["extractions"])
        return (
            Table("Content", [{**counts, **sources, "extractions": extractions}]),
            Table("Left out", shown["left_out"], "nothing was left out"),
            Table("Splits", shown["splits"], "too few pulses for any split"),
            Table("Predictors", range_rows(self.snapshot), "no predictors"),
            Table("Correlations", correlation_rows(self.snapshot), "no predictors"),
        )

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

    def tables(self) -> Sequence[Table]:
        """A row for each file, or for each fact of the pulse."""
        if isinstance(self.origin, list):
            return (Table("", self.origin, "no pulses"),)
        rows = [{"of": name, "value": str(value)} for name, value in self.origin.items()]
        return (Table("", rows, "nothing"),)

    def to_json(self) -> Any:
        """Facts of the pulse, or a list of files."""
        return self.origin


def _list(_: DatasetListing, laboratory: Laboratory, __: Progress) -> DatasetList:
    from ....dataset.catalog import list_snapshots, list_withdrawals

    with laboratory.store.reading() as session:
        withdrawals = list_withdrawals(session)
        rows = [
            {**row, "withdrawn": withdrawals[row["hash"]].lost if row["hash"] in withdrawals else 0}
            for row in list_snapshots(session)
        ]
    return DatasetList(tuple(rows), tuple(lost.words for lost in withdrawals.values()))


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


def _plot(shown: ShownDataset, path: Path) -> None:
    from .datasets import plot_dataset

    plot_dataset(shown.snapshot.table, path)


LIST_DATASETS = Operation(
    name="list-datasets",
    request=DatasetListing,
    run=_list,
    help="List the datasets with their name, hash, pulses and campaigns.",
    example="pyroshock dataset list",
    command=("dataset", "list"),
    route=("GET", "/datasets"),
    absent={"form": _READING},
)
SHOW_DATASET = Operation(
    name="show-dataset",
    request=DatasetShowing,
    run=_show,
    help="""Show a dataset, given by name or hash: its sources, its splits, and the ranges and
    correlations of its predictors.""",
    example="pyroshock dataset show rehearsal-pulses --plot pulses.png",
    command=("dataset", "show"),
    route=("GET", "/datasets/{name}"),
    outputs=(Output("plot", "Draw correlations and values into FILE.png.", _plot),),
    absent={"form": _READING},
)
TRACE_PULSE = Operation(
    name="trace-pulse",
    request=DatasetTracing,
    run=_trace,
    help="""Tell from which raw file a pulse of a dataset comes. KEY is the key of the pulse, or its
    beginning; without KEY, all files are listed.""",
    example="pyroshock dataset trace rehearsal-pulses",
    command=("dataset", "trace"),
    route=("GET", "/datasets/{name}/trace"),
    absent={"form": "the page of the dataset lists its files"},
)
