"""What is attached to a campaign, for its report: photographs with caption, name and hash, and a
list of the documents."""

from __future__ import annotations

from collections.abc import Sequence

from sqlalchemy.orm import Session

from ....schema.campaign_rows import attached_with_campaign
from ...common.reduced_pictures import PRINTED_PX, PictureError, reduced_picture
from ...documents.document import Block, Cell, Paragraph, Photograph, Photographs, Section, Table
from ..people.stored_attachments import StoredAttachment, attachments_where, content_of

#: Photographs of one report: each takes some megabytes while it is printed.
MOST_PHOTOGRAPHS = 100
_HEADS = ("file", "attached to", "caption", "size", "SHA-256")


def attached_section(session: Session, campaign_id: int) -> Section:
    """The photographs and documents of a campaign, its impacts, its plans and their runs.

    A picture that cannot be drawn is listed with the documents, and the reason is said.
    """
    there = [
        attachment
        for attachment in attachments_where(session, attached_with_campaign(campaign_id))
        if attachment.removed_at is None
    ]
    photographs: list[Photograph] = []
    listed: list[StoredAttachment] = []
    reasons: list[str] = []
    for attachment in there:
        if not attachment.is_picture:
            listed.append(attachment)
            continue
        reason = _too_many(attachment, len(photographs))
        if not reason:
            try:
                photographs.append(_photograph(session, attachment))
                continue
            except PictureError as error:  # the report says why it is listed alone
                reason = str(error)
        listed.append(attachment)
        reasons.append(f"{attachment.file_name} is listed and not printed: {reason}.")
    blocks: list[Block] = [Photographs(photographs)] if photographs else []
    blocks += [_table(listed)] if listed else []
    blocks += [Paragraph(reason, quiet=True) for reason in reasons]
    return Section("Photographs and documents", blocks)


def _too_many(attachment: StoredAttachment, printed: int) -> str:
    """Why a picture is not printed; "" of one that is."""
    if not attachment.is_shown:
        return (
            f"a picture of {attachment.width_px} × {attachment.height_px} pixels is too large to "
            "be drawn"
        )
    return "" if printed < MOST_PHOTOGRAPHS else f"a report has at most {MOST_PHOTOGRAPHS}"


def _photograph(session: Session, attachment: StoredAttachment) -> Photograph:
    jpeg, width_px, height_px = reduced_picture(content_of(session, attachment.key), PRINTED_PX)
    facts = (
        f"{attachment.file_name}, attached to {_about(attachment)} by {attachment.author} on "
        f"{attachment.attached_at:%Y-%m-%d}"
    )
    caption, sha256 = attachment.caption or "", attachment.sha256
    return Photograph(caption, facts, sha256, jpeg, width_px, height_px)


def _about(attachment: StoredAttachment) -> str:
    return f"{attachment.subject.kind} {attachment.subject.text}"


def _table(listed: Sequence[StoredAttachment]) -> Table:
    rows: list[list[Cell]] = [
        [
            attachment.file_name,
            _about(attachment),
            attachment.caption,
            f"{attachment.size_bytes:,} bytes",
            attachment.sha256,
        ]
        for attachment in listed
    ]
    return Table("Documents that are attached.", _HEADS, rows, main=("file", "caption"))
