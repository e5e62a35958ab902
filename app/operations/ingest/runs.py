"""Recordings of a campaign with their runs: listed, shown, discarded, and replaced by corrected
ones."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import quote

from pydantic import Field, model_validator

from ....schema.person_roles import ADMINISTRATOR
from ..fields import Names, Presentation, request_field
from ..laboratory import Laboratory
from ..operation import Operation, PlainData, Progress, Result, ResultTable, Rows
from .removed import DryRunnable, Reason, RemovedPart
from .request import ExtractionChoice, NamedCampaign

_SHOWN = {"form": "It changes nothing; the page of the campaign shows it."}
_RecordingPath = Annotated[str, Field(min_length=1, max_length=4000)]
_KEEPS_REASON = request_field(
    help="Say why. The store keeps the reason.", presentation=Presentation(metavar="TEXT")
)


class Recordings(Rows):
    """Recordings by path."""

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """A recording as a line of a table."""
        return {**row, "sha256": row["sha256"][:12], "runs": ", ".join(row["runs"])}


def _list(request: NamedCampaign, laboratory: Laboratory, _: Progress) -> Recordings:
    from ....schema.removal.part import list_recordings

    with laboratory.store.reading() as session:
        rows = list_recordings(session, request.campaign)
    return Recordings(rows, f"campaign {request.campaign} has no recordings")


RUN_LIST: Operation[NamedCampaign, Recordings] = Operation(
    name="run-list",
    request=NamedCampaign,
    run=_list,
    help="List the recordings of CAMPAIGN: path, status, hash of the file, runs with their "
    "repetitions.",
    example="pyroshock runs list rehearsal",
    command=("runs", "list"),
    route=("GET", "/campaigns/{campaign}/recordings"),
    listing=True,
    absent=_SHOWN,
)


class RecordingOfCampaign(NamedCampaign):
    """One recording of a campaign."""

    recording: _RecordingPath = request_field(
        help="Give its path as in runs.csv.", presentation=Presentation(positional=True)
    )


@dataclass(frozen=True)
class RecordingContents(Result):
    """What the store holds of a recording."""

    contents: Mapping[str, Any]

    def tables(self) -> Sequence[ResultTable]:
        """Its file, then impacts, shots, channels and findings."""
        plain = [
            {"name": key, "value": value}
            for key, value in self.contents.items()
            if not isinstance(value, list)
        ]
        lists = [
            ResultTable(key, value)
            for key, value in self.contents.items()
            if isinstance(value, list)
        ]
        return (ResultTable("", plain), *lists)

    def to_json(self) -> dict[str, Any]:
        """The same as plain data."""
        return dict(self.contents)


def _show(request: RecordingOfCampaign, laboratory: Laboratory, _: Progress) -> RecordingContents:
    from .recording_contents import recording_contents

    with laboratory.store.reading() as session:
        return RecordingContents(recording_contents(session, request.campaign, request.recording))


RUN_SHOW: Operation[RecordingOfCampaign, RecordingContents] = Operation(
    name="run-show",
    request=RecordingOfCampaign,
    run=_show,
    help="Show one RECORDING of CAMPAIGN: its impacts and shots with the run and repetition of "
    "each, and its findings.",
    example="pyroshock runs show rehearsal recordings/0001-01.h5",
    command=("runs", "show"),
    route=("GET", "/campaigns/{campaign}/recording"),
    absent=_SHOWN,
)


class StandingRequest(NamedCampaign):
    """A campaign, or one recording of it."""

    recording: _RecordingPath | None = request_field(
        None, help="Ask about this recording alone; its path is that in runs.csv."
    )


def _standing(request: StandingRequest, laboratory: Laboratory, _: Progress) -> PlainData:
    """Counts of rows, and what stands on them."""
    from .removal import standing_on

    return PlainData(
        standing_on(laboratory.store, laboratory.db, request.campaign, request.recording)
    )


_BY_DRY_RUN = "The dry run of a deletion tells it."

STANDING: Operation[StandingRequest, PlainData] = Operation(
    name="standing",
    request=StandingRequest,
    run=_standing,
    help="Rows that would go with a campaign, or with one recording of it, and what stands on "
    "them; nothing is written.",
    route=("GET", "/campaigns/{campaign}/standing"),
    absent={"command": _BY_DRY_RUN, "form": _BY_DRY_RUN, "python": _BY_DRY_RUN},
)


class RunDiscard(DryRunnable, NamedCampaign):
    """One recording that is taken out of the store, by its path or by its runs."""

    recording: _RecordingPath | None = request_field(
        None,
        help="Give the path of the recording as in runs.csv.",
        presentation=Presentation(positional=True),
    )
    run: tuple[int, ...] = request_field(
        (),
        max_length=1000,
        help="Name the recording by its run. The option can be repeated.",
        presentation=Presentation(metavar="N"),
    )
    repetition: int | None = request_field(
        None,
        help="Take the recording of this repetition. This needs exactly one --run.",
        presentation=Presentation(metavar="M"),
    )
    reason: Reason = _KEEPS_REASON

    @model_validator(mode="after")
    def _names_one(self) -> RunDiscard:
        if (self.recording is None) == (not self.run):
            raise ValueError("name one recording: its path as in runs.csv, or --run N")
        if self.repetition is not None and len(self.run) != 1:
            raise ValueError("--repetition goes with exactly one --run")
        return self


@dataclass(frozen=True)
class DiscardedRecording(RemovedPart):
    """A recording that went, or would go."""

    def address(self) -> str:
        """The page of the campaign, which offers to undo it."""
        return f"{super().address()}?discarded={self.stone['id']}"

    def notes(self) -> Sequence[str]:
        """What went, what stood on it, and how it is stored again."""
        advice = (
            f"  to bring it back: pyroshock runs restore {self.stone['campaign']} "
            f"{self.stone['recording']}"
        )
        return (*super().notes(), *(() if self.dry_run else (advice,)))


def _discard(request: RunDiscard, laboratory: Laboratory, _: Progress) -> DiscardedRecording:
    from ....schema.removal.part import recording_of_runs, recording_part
    from .removal import discard_recording

    with laboratory.store.reading() as session:
        if request.recording is not None:
            part = recording_part(session, request.campaign, request.recording)
        else:
            part = recording_of_runs(session, request.campaign, request.run, request.repetition)
    stone = discard_recording(laboratory.store, laboratory.db, part, request.reason)
    return DiscardedRecording(stone, request.dry_run)


RUN_DISCARD: Operation[RunDiscard, DiscardedRecording] = Operation(
    name="run-discard",
    role=ADMINISTRATOR,
    request=RunDiscard,
    run=_discard,
    help="""Take one RECORDING of CAMPAIGN out of the store, with its impacts, shots, pulses and
findings.

The store keeps a tombstone: the hash of the file, the time, the person, the reason, and what
depended on it. `pyroshock runs restore CAMPAIGN RECORDING` brings the recording back from the file
that keeps it. A later ingest of the folder does not bring it back by itself. Datasets keep their
name and hash, but can no longer be read. Models stay. Runs of a plan that are no longer recorded
are to be done again.""",
    example="pyroshock runs discard rehearsal recordings/0007-01.h5 "
    '--reason "the plate had come loose" --dry-run\n'
    'pyroshock runs discard rehearsal --run 7 --reason "the plate had come loose"',
    command=("runs", "discard"),
    route=("POST", "/campaigns/{campaign}/discard"),
    absent={"form": "The page of an impact discards its recording."},
)


@dataclass(frozen=True)
class RestoredRecording(Result):
    """A discarded recording that is in the store again, and the rows that came with it."""

    campaign: str
    recording: str
    added: Mapping[str, int]

    def notes(self) -> Sequence[str]:
        """What came back."""
        rows = ", ".join(f"{n} {name.replace('_', ' ')}" for name, n in self.added.items() if n)
        return (f"{self.campaign}, {self.recording}: restored {rows}",)

    def to_json(self) -> dict[str, Any]:
        """The same as plain data."""
        return {**vars(self), "added": dict(self.added)}

    def address(self) -> str:
        """The page of the campaign."""
        return f"/campaigns/{quote(self.campaign, safe='')}"


def _restore(
    request: RecordingOfCampaign, laboratory: Laboratory, _: Progress
) -> RestoredRecording:
    from ....schema.removal.returning import open_tombstones
    from .discarded import restore_recording

    with laboratory.store.reading() as session:
        stones = [
            stone.id for stone in open_tombstones(session, request.campaign, request.recording)
        ]
    if not stones:
        raise LookupError(
            f"no recording {request.recording!r} of campaign {request.campaign!r} is discarded"
        )
    return RestoredRecording(**restore_recording(laboratory.store, laboratory.db, stones[-1]))


RUN_RESTORE: Operation[RecordingOfCampaign, RestoredRecording] = Operation(
    name="run-restore",
    request=RecordingOfCampaign,
    run=_restore,
    help="""Bring a discarded RECORDING of CAMPAIGN back, with its impacts, shots, pulses and
findings.

A discard keeps the recording in a file beside the store. Datasets get their pulses back and can be
read again.""",
    example="pyroshock runs discard rehearsal recordings/0007-01.h5 "
    '--reason "the plate had come loose"\n'
    "pyroshock runs restore rehearsal recordings/0007-01.h5",
    command=("runs", "restore"),
    route=("POST", "/campaigns/{campaign}/undiscard"),
    absent={"form": "The list of what was deleted, /deleted, has a button for it."},
)


class RunReplacement(ExtractionChoice, DryRunnable, RecordingOfCampaign):
    """A recording that gives way to what its campaign folder holds now."""

    file: Path | None = request_field(
        None,
        help="Read this other file of a campaign folder, with its own path and rows.",
        presentation=Presentation(positional=True),
    )
    folder: Path | None = request_field(
        None,
        help="Read the campaign folder with the corrected row of runs.csv, or the new file.",
        presentation=Presentation(metavar="FOLDER", option="from"),
    )
    plan: str | None = request_field(
        None,
        max_length=200,
        help="Name the plan whose runs the campaign does. [default: the plan of the campaign's "
        "name, if there is one]",
        presentation=Presentation(completion="plan_names"),
    )
    free_factors: Names = request_field(
        (),
        help="This is the same option as that of `ingest`. It can be repeated.",
        presentation=Presentation(metavar="COLUMN", option="free-factor"),
    )
    confirmed: Names = request_field(
        (),
        help="This is the same option as that of `ingest`. It can be repeated.",
        presentation=Presentation(metavar="RULE", option="confirm"),
    )
    reason: Reason = _KEEPS_REASON

    @model_validator(mode="after")
    def _says_what_replaces(self) -> RunReplacement:
        if (self.file is None) == (self.folder is None):
            raise ValueError(
                "say what replaces it: --from FOLDER, or another FILE of the campaign folder"
            )
        return self

    def place(self) -> tuple[Path, str | None]:
        """The campaign folder, and the path of another file within it."""
        if self.file is None:
            assert self.folder is not None
            if not self.folder.is_dir():
                raise ValueError(f"--from is '{self.folder}'; expected a folder that exists")
            return self.folder, None
        file = self.file.resolve()
        if not file.is_file():
            raise ValueError(f"FILE is '{self.file}'; expected a file that exists")
        for folder in file.parents:
            if (folder / "campaign.toml").is_file():
                return folder, file.relative_to(folder).as_posix()
        raise ValueError(
            f"{self.file} lies in no campaign folder: no folder above it has a campaign.toml; put "
            "it beside its rows of runs.csv"
        )


@dataclass(frozen=True)
class ReplacedRecording(RemovedPart):
    """A recording that gave way to another one, or would: the path of the new one, and the number
    of its hits."""

    path: str = ""
    hits: int = 0

    def notes(self) -> Sequence[str]:
        """What went, what stood on it, and what stands in its place."""
        stone = self.stone
        verb = "would be stored" if self.dry_run else "stored"
        return (
            *super().notes(),
            f"  {verb} in its place: {self.path}, {self.hits} hits, file "
            f"{stone['replaced_by'][:12]}",
            *(
                f"  dataset {name} has {pulses} pulses again"
                for name, pulses in stone["returned"].items()
            ),
        )


def _replace(request: RunReplacement, laboratory: Laboratory, _: Progress) -> ReplacedRecording:
    from ....ingest.storing.replacement import prepared_replacement
    from .removal import replace_recording

    folder, path = request.place()
    replacement = prepared_replacement(
        laboratory.store,
        request.campaign,
        request.recording,
        folder,
        path,
        request.settings(),
        free_factors=request.free_factors,
        confirmed=request.confirmed,
    )
    stone = replace_recording(
        laboratory.store, laboratory.db, replacement, request.reason, request.plan
    )
    return ReplacedRecording(
        stone, request.dry_run, replacement.new.path, len(replacement.new.hits)
    )


_READS_HERE = "It reads corrected files of the machine that it runs on."

RUN_REPLACE: Operation[RunReplacement, ReplacedRecording] = Operation(
    name="run-replace",
    role=ADMINISTRATOR,
    request=RunReplacement,
    run=_replace,
    help="""Replace a stored RECORDING by what the campaign folder holds now, in one transaction.

With --from FOLDER, the file of the same path and the rows of runs.csv that name it are read again;
either may be corrected. With FILE, another file of a campaign folder is read, with its own path and
rows. The store keeps a tombstone of the old recording that names the hash of the new one. Other
recordings of the folder are not read.""",
    example="pyroshock runs replace rehearsal recordings/0008-01.h5 --from corrected/ "
    '--reason "tip radius corrected"',
    command=("runs", "replace"),
    absent={"json": _READS_HERE, "form": _READS_HERE},
)
