"""Campaigns of the store: listed, shown, begun, deleted, archived and restored."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal
from urllib.parse import quote

from pydantic import Field, ValidationInfo, model_validator

from ....schema.known_facts import facts_from_json
from ....schema.person_roles import ADMINISTRATOR, ENGINEER
from ..fields import Presentation, request_field, source_of
from ..laboratory import Laboratory
from ..machine_paths import MachineFile, NewFile
from ..operation import (
    FormPage,
    Lines,
    NotHereError,
    Operation,
    Outcome,
    Progress,
    Request,
    Result,
    ResultTable,
    Rows,
)
from ..people.tags import TagWord
from ..upload_folders import is_scratch
from .removed import DryRunnable, Reason, RemovedPart, removal_row
from .request import NamedCampaign

_SHOWN = {"form": "It changes nothing; a page shows it."}


def _tag_field() -> Any:
    return request_field(None, help="Give those that people have put this tag on.")


class CampaignSelection(Request):
    """Which campaigns are listed."""

    tag: TagWord | None = _tag_field()


def _list(request: CampaignSelection, laboratory: Laboratory, _: Progress) -> Rows:
    from ....schema.listings import list_campaigns

    with laboratory.store.reading() as session:
        rows = list_campaigns(session, request.tag)
    empty = "no campaigns yet; read one with: pyroshock ingest FOLDER"
    return Rows(rows, empty if request.tag is None else f"no campaign has the tag {request.tag}")


CAMPAIGN_LIST: Operation[CampaignSelection, Rows] = Operation(
    name="campaign-list",
    request=CampaignSelection,
    run=_list,
    help="List the campaigns with their counts.",
    example="pyroshock campaigns list --sort -shots --columns name,kind,shots\n"
    "pyroshock campaigns list --tag doubtful",
    command=("campaigns", "list"),
    listing=True,
    absent={**_SHOWN, "json": "GET /api/campaigns gives the list page by page."},
)


class CampaignPage(Request):
    """Which campaigns a page of their list has."""

    kind: Literal["gun", "hammer"] | None = request_field(
        None, help="Give those of this kind of bench."
    )
    name: str = request_field(
        "", max_length=1000, help="Give those with this text within their name."
    )
    tag: TagWord | None = _tag_field()
    after: str | None = request_field(
        None, max_length=1000, help="Begin behind the campaign of this name."
    )
    limit: Annotated[int, Field(ge=1, le=1000)] = request_field(100, help="Give at most this many.")


def _page(request: CampaignPage, laboratory: Laboratory, _: Progress) -> Rows:
    from .campaign_overview import list_campaigns_page

    with laboratory.store.reading() as session:
        rows, _following = list_campaigns_page(
            session,
            kind=request.kind,
            text=request.name,
            tag=request.tag,
            after=request.after,
            limit=request.limit,
        )
    return Rows(rows, "no campaigns")


_BY_LIST = "The list of all campaigns has it."

CAMPAIGN_PAGE: Operation[CampaignPage, Rows] = Operation(
    name="campaign-page",
    request=CampaignPage,
    run=_page,
    help="Campaigns, the newest first; the next page begins `after` the last name of this one.",
    route=("GET", "/campaigns"),
    absent={**_SHOWN, "command": _BY_LIST, "python": _BY_LIST},
)


@dataclass(frozen=True)
class CampaignOverview(Result):
    """A campaign with all that its page shows."""

    overview: Mapping[str, Any]

    def tables(self) -> Sequence[ResultTable | Lines]:
        """Bench and counts, facts, findings, and the first rows."""
        return tuple(self._tables())

    def _tables(self) -> Iterator[ResultTable | Lines]:
        overview = self.overview
        plain = {
            key: value
            for title in ("campaign", "counts")
            for key, value in overview[title].items()
            if not isinstance(value, list | dict)
        }
        yield ResultTable("", [{"name": key, "value": value} for key, value in plain.items()])
        facts = facts_from_json(overview["campaign"]["known"])
        yield Lines("known facts", [f"{fact.name}: {fact.words}" for fact in facts])
        missing = overview["missing_facts"]
        yield Lines("missing facts", [missing] if missing else [])
        yield Lines("rows and recordings differ", overview["shot_differences"])
        for title in ("findings", "first_impacts", "first_shots"):
            yield ResultTable(title.replace("_", " "), overview[title])

    def to_json(self) -> Any:
        """Design coverage, achieved against planned settings, findings, and the first rows."""
        from ...common.number_format import finite

        return finite(dict(self.overview))


def _show(request: NamedCampaign, laboratory: Laboratory, _: Progress) -> CampaignOverview:
    from .campaign_overview import campaign_overview

    with laboratory.store.reading() as session:
        return CampaignOverview(campaign_overview(session, request.campaign))


CAMPAIGN_SHOW: Operation[NamedCampaign, CampaignOverview] = Operation(
    name="campaign-show",
    request=NamedCampaign,
    run=_show,
    help="Show a campaign: bench, counts, plans, levels of its factors, achieved settings, "
    "findings and first rows.",
    example="pyroshock campaigns show rehearsal",
    command=("campaigns", "show"),
    route=("GET", "/campaigns/{campaign}"),
    absent=_SHOWN,
)


class CampaignStart(Request):
    """The folder of a new campaign."""

    folder: Path = request_field(
        help="Write to this folder.", presentation=Presentation(positional=True)
    )
    kind: Literal["gun", "hammer", "drop"] = request_field(
        help="Choose the kind of the bench; `drop` has accelerometers only."
    )
    plan: str | None = request_field(
        None,
        max_length=1000,
        help="Write a row for each repetition that this plan still asks for.",
        presentation=Presentation(metavar="NAME", completion="plan_names"),
    )
    recordings: str | None = request_field(
        None,
        max_length=4000,
        help="Take these files, or a folder within FOLDER. [default: without a plan, all that are "
        "there]",
        presentation=Presentation(metavar="PATTERN"),
    )


def _start(request: CampaignStart, laboratory: Laboratory, _: Progress) -> Outcome:
    from .service import start_campaign

    new = start_campaign(
        laboratory.store, request.folder, request.kind, request.plan, request.recordings
    )
    folder = request.folder
    lines = (
        *(f"  {text}" for text in new.notes),
        f"written: {folder / 'campaign.toml'} and {folder / 'runs.csv'}",
        f"fill in what says FILL IN, then: pyroshock ingest {folder} --dry-run",
    )
    return Outcome(lines, {"folder": str(folder), "notes": list(new.notes)})


_WRITES_HERE = "It writes into a folder of the machine that it runs on."

CAMPAIGN_INIT: Operation[CampaignStart, Outcome] = Operation(
    name="campaign-init",
    request=CampaignStart,
    run=_start,
    help="""Begin the FOLDER of a campaign: write a commented campaign.toml and a runs.csv, which
you complete and ingest.

The rows come from a plan of the store; without a plan there is a row for each recording. Channels,
their rates and their units come from the recordings where these contain them. What you must write
is marked FILL IN, and what may be wrong is marked "please check". Files that exist are never
overwritten.""",
    example="pyroshock plan lhs autumn --runs 12\n"
    "pyroshock campaigns init autumn --kind gun --plan autumn",
    command=("campaigns", "init"),
    needs_store=False,
    absent={"json": _WRITES_HERE, "form": _WRITES_HERE},
)


class CampaignRemoval(DryRunnable, NamedCampaign):
    """A campaign that is deleted."""

    reason: Reason = request_field(
        help="Say why it is deleted. The store keeps the reason.",
        presentation=Presentation(metavar="TEXT"),
    )


def _delete(request: CampaignRemoval, laboratory: Laboratory, _: Progress) -> RemovedPart:
    from .removal import delete_campaign

    stone = delete_campaign(laboratory.store, laboratory.db, request.campaign, request.reason)
    return RemovedPart(stone, request.dry_run)


CAMPAIGN_DELETE: Operation[CampaignRemoval, RemovedPart] = Operation(
    name="campaign-delete",
    role=ADMINISTRATOR,
    request=CampaignRemoval,
    run=_delete,
    help="""Delete a campaign with its recordings, impacts, shots, diagnoses and adopted effects.

A deleted campaign cannot be brought back. `campaigns archive` deletes a campaign, too, but keeps it
in a file.

The store keeps a tombstone: the hash of the content, the time, the person, the reason, and what
depended on the campaign. Datasets keep their name and hash, but can no longer be read. Models that
were trained on them stay and work. Reports of diagnoses stay in the tombstone. Runs of a plan that
are no longer recorded are to be done again.""",
    example='pyroshock campaigns delete first-shots --reason "wrong sensor, repeated in autumn" '
    "--dry-run\n"
    'pyroshock campaigns delete first-shots --reason "wrong sensor, repeated in autumn"',
    command=("campaigns", "delete"),
    route=("POST", "/campaigns/{campaign}/delete"),
    form=FormPage("/campaigns/{campaign}/delete", "removal", "/campaigns/{campaign}/delete"),
)


class CampaignArchiving(NamedCampaign):
    """A campaign that leaves the store for a file."""

    out: NewFile | None = request_field(
        None,
        help="Write to FILE, which must not exist. [default: over the network, one that the server "
        "names]",
        presentation=Presentation(metavar="FILE"),
    )
    reason: Reason = request_field(
        help="Say why it leaves the store. The store keeps the reason.",
        presentation=Presentation(metavar="TEXT"),
    )


@dataclass(frozen=True)
class ArchivedCampaign(RemovedPart):
    """A campaign that lies in a file."""

    def notes(self) -> Sequence[str]:
        """What went, and the file that brings it back."""
        stone = self.stone
        return (
            *super().notes(),
            f"  archived in {stone['archive_path']} (SHA-256 {stone['archive_sha256'][:12]})",
            f"  to bring it back: pyroshock campaigns restore {stone['archive_path']}",
        )

    def stored_keys(self) -> Mapping[str, Any]:
        """The file."""
        return {"file": self.stone["archive_path"]}

    def address(self) -> str:
        """The list of what was deleted or archived."""
        return "/deleted"

    def summary(self) -> str:
        """The campaign and its file."""
        name = Path(self.stone["archive_path"]).name
        return f"Campaign {self.stone['campaign']} was archived in {name}."


def _is_stored(request: CampaignArchiving, laboratory: Laboratory) -> None:
    """Raises `LookupError` for a campaign that there is not."""
    from .removal import standing_on

    if laboratory.folders is not None:
        standing_on(laboratory.store, laboratory.db, request.campaign)
    elif request.out is None:
        raise ValueError("--out is missing; expected the path of a new file")


def _archive(
    request: CampaignArchiving, laboratory: Laboratory, progress: Progress
) -> ArchivedCampaign:
    from .archiving import archive_campaign, archive_folder, archived_in

    out = request.out
    if out is None:
        folder = archive_folder(laboratory.db)
        folder.mkdir(parents=True, exist_ok=True)
        name = quote(request.campaign, safe="")[:150]
        out = folder / f"{name}-{laboratory.job}.pyroshock"
        # an earlier attempt of the job may have done it
        stone = archived_in(laboratory.store, out)
        if stone is not None:
            return ArchivedCampaign(stone)

    def step(done: int, total: int, *what: Any) -> None:
        progress(done, total, " ".join(map(str, what)) or "rows")

    stone = archive_campaign(
        laboratory.store, laboratory.db, request.campaign, out, request.reason, step
    )
    return ArchivedCampaign(stone)


ARCHIVE: Operation[CampaignArchiving, ArchivedCampaign] = Operation(
    name="archive",
    role=ENGINEER,
    request=CampaignArchiving,
    run=_archive,
    check=_is_stored,
    help="""Write a campaign to FILE, read the file back, then delete the campaign from the store.

The store keeps a tombstone with the name of the file and its SHA-256. `campaigns restore FILE`
brings the campaign back, with its diagnoses, its adopted effects, and the pulses of its datasets.
The same command completes an archive that was interrupted.""",
    example="pyroshock campaigns archive first-shots --out first-shots.pyroshock "
    '--reason "finished, kept on the shelf"',
    command=("campaigns", "archive"),
    route=("POST", "/campaigns/{campaign}/archive"),
    long=True,
    steps="rows",
    on_this_machine=True,
    form=FormPage("/campaigns/{campaign}/archive", "removal", "/campaigns/{campaign}/archive"),
)


class CampaignReturn(Request):
    """A campaign that comes back from its file."""

    file: MachineFile = request_field(
        help="Read this file, which `campaigns archive` or `db export` wrote before.",
        presentation=Presentation(positional=True),
    )

    @model_validator(mode="before")
    @classmethod
    def _of_an_older_job(cls, values: Any, info: ValidationInfo) -> Any:
        """Jobs of earlier versions have an upload's folder beside its file."""
        if source_of(info) != "stored" or not isinstance(values.get("file"), str):
            return values
        return {"file": {"path": values["file"], "scratch": values.get("scratch")}}


@dataclass(frozen=True)
class RestoredCampaign(Result):
    """A campaign that is in the store again; `stone` is its tombstone with what came back."""

    stone: Mapping[str, Any]

    def notes(self) -> Sequence[str]:
        """What came back, and what could not be as before."""
        stone = self.stone
        return (
            f"{stone['campaign']}: restored, {self._rows()} rows; "
            f"content hash {stone['content_hash']}",
            *(
                f"  dataset {name} has {pulses} pulses again"
                for name, pulses in stone["returned"].items()
            ),
            *(f"  {words}" for words in stone["notes"]),
        )

    def to_json(self) -> dict[str, Any]:
        """The tombstone, with counts of what came back."""
        return dict(self.stone)

    def address(self) -> str:
        """The page of the campaign."""
        return f"/campaigns/{quote(self.stone['campaign'], safe='')}"

    def summary(self) -> str:
        """What came back."""
        words = f"Campaign {self.stone['campaign']} is in the store again, {self._rows()} rows."
        return " ".join([words, *self.stone["notes"]])

    def _rows(self) -> int:
        return sum(self.stone["added"].values())


@dataclass(frozen=True)
class _ReadableArchive:
    file: Path
    progress: Progress


def _readable(
    request: CampaignReturn, laboratory: Laboratory, progress: Progress
) -> _ReadableArchive:
    from .archiving import kept_archive

    file, scratch = request.file.path, request.file.scratch
    if laboratory.folders is not None:
        is_upload = (
            scratch is not None
            and is_scratch(scratch)
            and file.parent.resolve() == scratch.resolve()
        )
        is_kept = scratch is None and kept_archive(laboratory.db, str(file)) is not None
        if not (is_upload or is_kept) or not file.is_file():
            raise NotHereError(f"this worker may not read {file}, or it is not there any more")
    return _ReadableArchive(file, progress)


def _restore(archive: _ReadableArchive, laboratory: Laboratory) -> RestoredCampaign:
    from .archiving import restore_campaign

    def step(done: int, total: int, *what: Any) -> None:
        archive.progress(done, total, " ".join(map(str, what)) or "samples")

    shown = step if laboratory.job == 0 else None
    return RestoredCampaign(restore_campaign(laboratory.store, archive.file, shown))


_BY_UPLOAD = "The page /deleted takes an upload of the file, or the one that this machine kept."

RESTORE: Operation[CampaignReturn, RestoredCampaign] = Operation(
    name="restore",
    role=ADMINISTRATOR,
    request=CampaignReturn,
    run=_readable,
    keep=_restore,
    help="""Bring a deleted campaign back from FILE, which `campaigns archive` or `db export` wrote
before.

The content must be the same as that which was deleted. Datasets get their pulses back and can be
read again. Diagnoses and adopted effects come back. The tombstone stays and records the time of the
return.""",
    example="pyroshock campaigns archive first-shots --out first-shots.pyroshock "
    '--reason "finished"\n'
    "pyroshock campaigns restore first-shots.pyroshock",
    command=("campaigns", "restore"),
    long=True,
    steps="samples",
    on_this_machine=True,
    label=lambda request: request.file.path.name,
    form=FormPage("/deleted", "", ""),
    absent={"json": _BY_UPLOAD, "form": _BY_UPLOAD},
)


class DeletionListing(Request):
    """Whose deletions are listed."""

    campaign: str | None = request_field(
        None,
        max_length=1000,
        help="List what was deleted of this campaign. [default: of all]",
    )


class Deletions(Rows):
    """Tombstones, the oldest first."""

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """A tombstone as a line of a table."""
        return removal_row(row)


def _deleted(request: DeletionListing, laboratory: Laboratory, _: Progress) -> Deletions:
    from .removal import list_tombstones

    with laboratory.store.reading() as session:
        return Deletions(list_tombstones(session, request.campaign), "nothing was deleted")


DELETED_LIST: Operation[DeletionListing, Deletions] = Operation(
    name="deleted-list",
    request=DeletionListing,
    run=_deleted,
    help="List what was deleted: campaigns and recordings with time, reason, hash, and what "
    "depended on them.",
    example="pyroshock campaigns deleted",
    command=("campaigns", "deleted"),
    route=("GET", "/deleted"),
    listing=True,
    absent={"form": "It changes nothing; the page /deleted shows the list."},
)
