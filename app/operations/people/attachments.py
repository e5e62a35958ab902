"""Photographs and documents attached to campaigns, runs, impacts and plans: added, listed, read,
removed and restored."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BeforeValidator, model_validator

from ....schema.person_roles import ENGINEER, OPERATOR, READER
from ..faults import about
from ..fields import Key, Presentation, RecordedFile, any_file, request_field, row_limit
from ..laboratory import Laboratory
from ..operation import FormPage, Operation, Outcome, Output, Progress, Request, Result, Rows
from .subjects import Subject, find_subject

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from .stored_attachments import StoredAttachment

#: As `schema.attached_files.MOST_BYTES`, which needs the tables; a test compares them.
MOST_BYTES = 50_000_000
_USUAL, _MOST = 100, 1000
_KINDS = ("campaign", "run", "impact", "plan")


def _as_text(value: Any) -> Any:
    """An impact by its number, in Python and JSON."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


_Name = Annotated[str, BeforeValidator(_as_text)]


def _subject_field(help: str, completion: str = "") -> Any:
    return request_field(
        None,
        max_length=1000,
        help=help,
        presentation=Presentation(metavar="NAME", completion=completion),
    )


class AboutOne(Request):
    """One of a campaign, a run, an impact and a plan."""

    campaign: _Name | None = _subject_field("Name the campaign.", "campaign_names")
    run: _Name | None = _subject_field("Name the run of a plan, as PLAN/RUN.")
    impact: _Name | None = _subject_field(
        "Give the number of the impact, or CAMPAIGN/RUN/REPETITION."
    )
    plan: _Name | None = _subject_field("Name the plan.", "plan_names")

    @property
    def stated(self) -> list[tuple[str, str]]:
        """The kinds that are named, with the names."""
        names = ((kind, getattr(self, kind)) for kind in _KINDS)
        return [(kind, name) for kind, name in names if name is not None]

    @property
    def words(self) -> str:
        """What it is about, for a list."""
        return " ".join(part for pair in self.stated for part in pair)


class NewAttachment(AboutOne):
    """A file that is attached to a campaign, a run, an impact or a plan."""

    file: any_file(MOST_BYTES) = request_field(  # type: ignore[valid-type]
        help="Give the file: a picture, a PDF, a text, an Office file or a ZIP file, of at most "
        "50 MB.",
        presentation=Presentation(positional=True, metavar="FILE"),
    )
    caption: str | None = request_field(
        None, max_length=2000, help="Say what the file shows; pages and reports print it."
    )

    @model_validator(mode="after")
    def _is_about_one(self) -> NewAttachment:
        if len(self.stated) != 1:
            kinds = ", ".join(kind for kind, _ in self.stated) or "none of them"
            raise ValueError(
                f"a file is attached to one campaign, run, impact or plan, and {kinds} is given; "
                "name one"
            )
        return self


def _outcome(session: Session, attachment: StoredAttachment, what: str) -> Outcome:
    subject = attachment.subject
    line = (
        f"attachment {attachment.key} ({attachment.file_name}) on {subject.kind} {subject.text}: "
        f"{what}"
    )
    page = subject.page(session)
    address = f"{page}#attachments-{subject.kind}" if page else "/attachments"
    return Outcome((line,), attachment.to_json(), address)


def _add(request: NewAttachment, laboratory: Laboratory, _: Progress) -> Outcome:
    from ....schema.attached_files import checked_media_type
    from .stored_attachments import add_attachment, clean_name, get_attachment

    file: RecordedFile = request.file
    ((kind, name),) = request.stated
    with about("file"):
        file_name, content = clean_name(file.name), file.read_bytes()
        try:
            checked_media_type(content)
        except ValueError as error:
            raise ValueError(f"file is {file_name!r:.120} and cannot be taken: {error}") from error

    def add(session: Session) -> Outcome:
        subject = find_subject(session, kind, name)
        with about("file"):
            key = add_attachment(
                session, subject, file_name, content, request.caption, laboratory.person
            )
        attachment = get_attachment(session, key)
        what = f"{attachment.media_type}, SHA-256 {attachment.sha256[:12]}…"
        return _outcome(session, attachment, what)

    return laboratory.store.write(add)


ATTACHMENT_ADD: Operation[NewAttachment, Outcome] = Operation(
    name="attachment-add",
    request=NewAttachment,
    run=_add,
    help="""Attach a photograph or a document to a campaign, a run of a plan, an impact or a plan,
with your name and the time.

The file lies in the store under its SHA-256, which every reading compares. What it is, its bytes
say and not its name: JPEG, PNG, GIF and WebP pictures are shown on pages and in reports; PDF, text,
Office files and ZIP are handed out as files. HTML, SVG and XML are refused.""",
    example="pyroshock show 1 --plot impact.png\npyroshock attachments add impact.png --impact 1 "
    '--caption "as recorded"',
    command=("attachments", "add"),
    route=("POST", "/attachments"),
    role=OPERATOR,
    label=lambda request: request.words,
    form=FormPage("/attachments", "attachment-add", "/attachments"),
)


class NamedAttachment(Request):
    """One attached file."""

    attachment: Key = request_field(
        help="Give the number of the attachment.", presentation=Presentation(positional=True)
    )


@dataclass(frozen=True)
class AttachedFile(Result):
    """An attached file: what the store says of it, and its bytes."""

    facts: dict[str, Any]
    content: bytes

    def to_json(self) -> dict[str, Any]:
        """What the store says of it."""
        return dict(self.facts)

    def to_network_json(self) -> dict[str, Any]:
        """The same with the bytes in base64."""
        return {**self.facts, "content": base64.b64encode(self.content).decode()}

    def notes(self) -> list[str]:
        """Name, size and hash."""
        facts = self.facts
        return [
            f"{facts['file_name']}: {facts['media_type']}, {facts['size_bytes']:,} bytes, SHA-256 "
            f"{facts['sha256']}"
        ]

    def write(self, path: str | Path) -> None:
        """Write the file, in the place of one of the same name.

        Parameters:
            path: The path of the new file.
        """
        from ....files.atomic_write import write_bytes

        write_bytes(Path(path), self.content)


def _get(request: NamedAttachment, laboratory: Laboratory, _: Progress) -> AttachedFile:
    from .stored_attachments import content_of, get_attachment

    with laboratory.store.reading() as session:
        facts = get_attachment(session, request.attachment).to_json()
        return AttachedFile(facts, content_of(session, request.attachment))


ATTACHMENT_GET: Operation[NamedAttachment, AttachedFile] = Operation(
    name="attachment-get",
    request=NamedAttachment,
    run=_get,
    help="Read an attached file, whose SHA-256 is compared, and write it with --out.",
    example="pyroshock show 1 --plot impact.png\n"
    "pyroshock attachments add impact.png --impact 1\n"
    "pyroshock attachments get 1 --out again.png",
    command=("attachments", "get"),
    route=("GET", "/attachments/{attachment}"),
    role=READER,
    outputs=(
        Output(
            "out",
            "Write to FILE. A file of the same name is replaced.",
            AttachedFile.write,
        ),
    ),
    absent={"form": "The page of its subject has a link to the file."},
)


class Removal(NamedAttachment):
    """An attached file that is taken off."""

    reason: str = request_field(
        min_length=1, max_length=2000, help="Say why; the reason stays with the attachment."
    )


def _remove(request: Removal, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_attachments import remove_attachment

    def remove(session: Session) -> Outcome:
        attachment = remove_attachment(
            session, request.attachment, request.reason, laboratory.person
        )
        return _outcome(session, attachment, "removed; it can be restored")

    return laboratory.store.write(remove)


ATTACHMENT_REMOVE: Operation[Removal, Outcome] = Operation(
    name="attachment-remove",
    request=Removal,
    run=_remove,
    help="Take an attached file off, with a reason: pages and reports show it no more. It stays in "
    "the store, and `pyroshock attachments restore` puts it back.",
    example="pyroshock show 1 --plot impact.png\n"
    "pyroshock attachments add impact.png --impact 1\n"
    'pyroshock attachments remove 1 --reason "of another impact"',
    command=("attachments", "remove"),
    route=("POST", "/attachments/{attachment}/remove"),
    role=ENGINEER,
    form=FormPage("/attachments", "attachment-remove", "/attachments/{attachment}/remove"),
)


def _restore(request: NamedAttachment, laboratory: Laboratory, _: Progress) -> Outcome:
    from .stored_attachments import restore_attachment

    return laboratory.store.write(
        lambda session: _outcome(
            session, restore_attachment(session, request.attachment), "restored"
        )
    )


ATTACHMENT_RESTORE: Operation[NamedAttachment, Outcome] = Operation(
    name="attachment-restore",
    request=NamedAttachment,
    run=_restore,
    help="Put an attached file back that was removed.",
    example="pyroshock show 1 --plot impact.png\n"
    "pyroshock attachments add impact.png --impact 1\n"
    'pyroshock attachments remove 1 --reason "of another impact"\n'
    "pyroshock attachments restore 1",
    command=("attachments", "restore"),
    route=("POST", "/attachments/{attachment}/restore"),
    role=ENGINEER,
    form=FormPage("/attachments", "attachment-restore", "/attachments/{attachment}/restore"),
)


class AttachmentQuestion(AboutOne):
    """Which attached files are listed: of a campaign also those of its impacts."""

    removed: bool = request_field(False, help="List those that were removed, too.")
    limit: row_limit(_USUAL, _MOST) = request_field(  # type: ignore[valid-type]
        None,
        validate_default=True,
        help="List at most this number, the newest first.",
        presentation=Presentation(option="last"),
    )

    @model_validator(mode="after")
    def _is_about_one_at_most(self) -> AttachmentQuestion:
        if len(self.stated) > 1:
            kinds = ", ".join(kind for kind, _ in self.stated)
            raise ValueError(f"{kinds} are given; name one of them, or none for all attachments")
        return self


class AttachmentRows(Rows):
    """Attached files, the newest first."""

    def shortened(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """With the beginning of the hash."""
        names = ("attachment", "about", "subject", "file_name", "media_type", "size_bytes")
        caption = row["caption"] or ""
        if row["removed_at"] is not None:
            caption = f"removed: {row['removal_reason']}"
        return {
            **{name: row[name] for name in names},
            "sha256": row["sha256"][:12],
            "author": row["author"],
            "attached_at": row["attached_at"],
            "caption": " ".join(caption.split()),
        }


def _list(request: AttachmentQuestion, laboratory: Laboratory, _: Progress) -> AttachmentRows:
    with laboratory.store.reading() as session:
        attachments = _chosen(session, request)
    if not request.removed:
        attachments = [row for row in attachments if row.removed_at is None]
    rows = [attachment.to_json() for attachment in attachments[: request.limit]]
    return AttachmentRows(rows, "no attachments yet")


def _chosen(session: Session, request: AttachmentQuestion) -> list[StoredAttachment]:
    """The newest first."""
    from ....schema.listings import get_campaign_id
    from .stored_attachments import attachments_of_campaign, attachments_on, recent_attachments

    if not request.stated:
        return recent_attachments(session, request.limit, removed=request.removed)
    ((kind, name),) = request.stated
    subject: Subject = find_subject(session, kind, name)
    if kind == "campaign":
        return attachments_of_campaign(session, get_campaign_id(session, subject.name))[::-1]
    return attachments_on(session, subject)[::-1]


ATTACHMENT_LIST: Operation[AttachmentQuestion, AttachmentRows] = Operation(
    name="attachment-list",
    request=AttachmentQuestion,
    run=_list,
    help="List the attached photographs and documents, the newest first: all, or those of one "
    "campaign with its impacts, one run, impact or plan.",
    example="pyroshock attachments list --campaign rehearsal",
    command=("attachments", "list"),
    route=("GET", "/attachments"),
    listing=True,
    label=lambda request: request.words,
    absent={"form": "The page /attachments shows the list."},
)
