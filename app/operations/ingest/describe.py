"""Describe a folder of recordings that nobody has described yet: what its files say, and the
campaign.toml and runs.csv that follow from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from ..fields import Presentation, request_field
from ..laboratory import Laboratory
from ..machine_paths import CARD, RecordingFolder
from ..operation import FormPage, Operation, Output, Progress, Request, Result
from ..upload_folders import is_scratch

if TYPE_CHECKING:
    from ....ingest.folder.file_statements import FolderStatements
    from ....ingest.folder.proposal import DescriptionProposal
    from ....ingest.readers import ReadingOptions


class Description(Request):
    """A folder of recordings that is described."""

    path: RecordingFolder = request_field(
        help="Read the recordings of this folder.",
        presentation=Presentation(positional=True, metavar="FOLDER"),
    )
    kind: Literal["gun", "hammer", "plate"] | None = request_field(
        None,
        help="State the kind of the campaign; `plate` has accelerometers only. [default: what the "
        "recorded quantities tell]",
    )


@dataclass(frozen=True)
class DescribedFolder(Result):
    """What the files of a folder say (`channels`, `unreadable`, `sources`), and the description
    that follows: what is `stated` in campaign.toml, `columns` and `rows` of runs.csv. `texts` are
    those of both files, the first with the source behind each value."""

    folder: str
    kind: str
    recordings: list[str]
    unreadable: list[dict[str, str]]
    without_rate: int
    channels: list[dict[str, Any]]
    modal_tables: list[str]
    stated: dict[str, Any]
    columns: list[str]
    rows: list[dict[str, str]]
    sources: dict[str, str]
    texts: dict[str, str] = field(default_factory=dict)

    def text(self) -> str:
        """campaign.toml with the source of each value, and a comment for each that is missing."""
        return self.texts[CARD]

    def notes(self) -> Sequence[str]:
        """How many recordings were read, and which were not."""
        return (
            self.summary(),
            *(f"  not read: {row['reason']}" for row in self.unreadable),
        )

    def summary(self) -> str:
        """What was read, in a few words."""
        words = (
            f"{self.folder}: {len(self.recordings)} recordings with {len(self.channels)} channels"
        )
        return f"{words}; {len(self.unreadable)} files not read" if self.unreadable else words

    def to_json(self) -> dict[str, Any]:
        """The same as plain data."""
        return dict(vars(self))


def _described(request: Description, laboratory: Laboratory, progress: Progress) -> DescribedFolder:
    from ....ingest.folder.file_statements import read_statements
    from ....ingest.folder.proposal import propose
    from ....ingest.readers import AS_IN_FILE

    folder = request.path.readable(laboratory)
    options = _stated_options(folder) or AS_IN_FILE
    statements = read_statements(folder, options, progress, processes=laboratory.processes or 1)
    proposal = propose(folder, statements, _name(request, folder), request.kind or "")
    return described_folder(folder.name, statements, proposal)


def _name(request: Description, folder: Path) -> str:
    """What a person called the folder; nothing of a scratch folder's own name."""
    scratch = request.path.scratch
    if scratch is not None and folder.resolve() == scratch.resolve() and is_scratch(scratch):
        return ""
    return folder.resolve().name


def _stated_options(folder: Path) -> ReadingOptions | None:
    """What a campaign.toml of the folder says of its recordings; None where there is none that can
    be read."""
    from ....ingest.errors import IngestError
    from ....ingest.folder.description import read_description
    from ....ingest.folder.recording_options import reading_options

    try:
        return reading_options(read_description(folder).tables)
    except (IngestError, ValueError):  # the check of the folder tells what is wrong with it
        return None


def described_folder(
    name: str, statements: FolderStatements, proposal: DescriptionProposal
) -> DescribedFolder:
    """The answer of what was read and proposed.

    Parameters:
        name: What the folder is called.
        statements: What its recordings say.
        proposal: The description that follows.
    """
    description = proposal.description
    return DescribedFolder(
        folder=name,
        kind=proposal.kind,
        recordings=[file.path for file in statements.readable],
        unreadable=[
            {"recording": file.path, "reason": file.fault}
            for file in statements.files
            if file.fault
        ],
        without_rate=statements.without_rate,
        channels=[
            {
                "name": channel.name,
                "files": channel.files,
                "units": list(channel.units),
                "rates_hz": list(channel.rates_hz),
                "samples": channel.samples,
                "hints": dict(channel.hints),
            }
            for channel in statements.channels
        ],
        modal_tables=list(statements.modal_tables),
        stated=dict(description.tables),
        columns=list(description.columns),
        rows=[dict(row) for row in description.rows],
        sources=dict(proposal.sources),
        texts={CARD: proposal.campaign_text(), "runs.csv": description.runs_text()},
    )


def _write_new(name: str) -> Any:
    def write(described: DescribedFolder, path: Path) -> None:
        with path.open("x", encoding="utf-8", newline="") as file:
            file.write(described.texts[name])

    return write


def _refuse_existing(path: Path) -> None:
    """Raises `ValueError` for a file that is there: what a person wrote is never overwritten."""
    if path.exists():
        raise ValueError(f"{path} exists, and nothing is overwritten; name a new file")


_BY_FOLDER = (
    "It reads a folder of the machine that it runs on; an upload on the page /ingest asks it."
)

DESCRIBE: Operation[Description, DescribedFolder] = Operation(
    name="describe",
    request=Description,
    run=_described,
    help="""Read what the recordings of FOLDER say, and propose campaign.toml and runs.csv.

Channels, units, sampling rates, dates and further fields come from the files; each value stands
beside its source. What the files do not say is not guessed: it stands as a comment with the reason
why it is needed. The page /ingest shows the same as a form, and writes both files from it.""",
    example="pyroshock campaigns describe recordings/ --out campaign.toml --runs runs.csv",
    command=("campaigns", "describe"),
    long=True,
    steps="recordings",
    processes="Set the number of processes that open files; few files need only one.",
    needs_store=False,
    on_this_machine=True,
    keeps_uploads=True,
    job_page="/ingest/forms/{job}",
    result_page="/ingest/forms/{job}",
    label=lambda request: Path(request.path.path).name,
    outputs=(
        Output(
            "out",
            "Write the proposed campaign.toml to FILE, which must not exist.",
            _write_new(CARD),
            in_place_of_tables=True,
            check=_refuse_existing,
        ),
        Output(
            "runs",
            "Write the proposed runs.csv to FILE, which must not exist.",
            _write_new("runs.csv"),
            check=_refuse_existing,
        ),
    ),
    form=FormPage("/ingest", "by-path", "/ingest/describe", "upload"),
    absent={"json": _BY_FOLDER, "python": _BY_FOLDER},
)
