"""Every attached file is the one that was attached: all of its pieces, and the SHA-256 of its
bytes."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from typing import Any

from sqlalchemy import ColumnElement, Connection, func, select

from ....files.media_types import MediaTypeError, media_type_of
from ...attached_files import MOST_BYTES, PIECE_BYTES, AttachedFileError, iter_pieces
from ...attachments import AttachedContent, AttachedPiece, Attachment
from ...campaign_rows import members
from ..findings import RESTORE, IntegrityFinding, Scope

#: A row of a content, and a name and a subject under which it is attached.
ContentRow = Any
_NOT_ATTACHED = "nothing says what it is attached to"


def check_attachments(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """Attached files of which a piece is missing, altered or too many, whose kind is another than
    their row says, or that are attached to nothing."""
    for row in _contents(connection, scope):
        message = _attached_nowhere(row) or _beyond(connection, row) or _content(connection, row)
        if message:
            yield _finding(row, message)


def check_attached_pieces(connection: Connection, scope: Scope) -> Iterator[IntegrityFinding]:
    """Attached files with another number of pieces: what `check_attachments` finds of gaps, without
    reading any."""
    for row in _contents(connection, scope):
        pieces = connection.scalar(select(func.count()).where(AttachedPiece.content_id == row.id))
        expected = -(-row.size_bytes // PIECE_BYTES)
        message = _attached_nowhere(row)
        if pieces != expected:
            message = f"{pieces} pieces; expected {expected}"
        if message:
            yield _finding(row, message)


def _contents(connection: Connection, scope: Scope) -> list[ContentRow]:
    """The contents of the scope, each with the first of its attachments."""
    first = (
        select(Attachment.content_id, func.min(Attachment.id).label("attachment_id"))
        .group_by(Attachment.content_id)
        .subquery()
    )
    query = (
        select(
            AttachedContent.id,
            AttachedContent.sha256,
            AttachedContent.size_bytes,
            AttachedContent.media_type,
            AttachedContent.width_px,
            AttachedContent.height_px,
            Attachment.file_name,
            Attachment.subject_kind,
            Attachment.subject,
        )
        .outerjoin(first, first.c.content_id == AttachedContent.id)
        .outerjoin(Attachment, Attachment.id == first.c.attachment_id)
        .order_by(AttachedContent.id)
    )
    if scope.campaign is not None:
        chosen: ColumnElement[bool] = members(scope.campaign)["attached_contents"]
        query = query.where(chosen)
    return list(connection.execute(query))


def _attached_nowhere(row: ContentRow) -> str:
    return "" if row.file_name is not None else _NOT_ATTACHED


def _beyond(connection: Connection, row: ContentRow) -> str:
    if not 0 < row.size_bytes <= MOST_BYTES:
        return f"its size is {row.size_bytes:,} bytes; expected 1 to {MOST_BYTES:,}"
    expected = -(-row.size_bytes // PIECE_BYTES)
    beyond = select(func.count()).where(
        AttachedPiece.content_id == row.id, ~AttachedPiece.number.between(0, expected - 1)
    )
    count = connection.scalar(beyond)
    return f"{count} pieces beyond the {expected} of its size" if count else ""


def _content(connection: Connection, row: ContentRow) -> str:
    """What is wrong with the bytes; "" of a whole file."""
    digest, pieces = hashlib.sha256(), []
    try:
        for piece in iter_pieces(connection, row.id, row.size_bytes):
            digest.update(piece)
            pieces.append(piece)
    except AttachedFileError as error:  # the check reports it as what is wrong
        return str(error)
    if digest.hexdigest() != row.sha256:
        return (
            f"its bytes have the SHA-256 {digest.hexdigest()[:12]}…, attached was "
            f"{row.sha256[:12]}…"
        )
    try:
        kind = media_type_of(b"".join(pieces))
    except MediaTypeError as error:  # no such bytes were taken: the check reports them
        return str(error)
    stated = (row.media_type, row.width_px, row.height_px)
    if stated != (kind.name, kind.width_px, kind.height_px):
        return f"its row says {_words(*stated)}, its bytes are {_words(*vars(kind).values())}"
    return ""


def _words(media_type: str, width_px: int | None, height_px: int | None) -> str:
    return media_type if width_px is None else f"{media_type} of {width_px} × {height_px} pixels"


def _finding(row: ContentRow, message: str) -> IntegrityFinding:
    place = {
        row.subject_kind or "": row.subject,
        "attachment": row.file_name,
        "content": row.sha256[:12],
    }
    named = {key: value for key, value in place.items() if value is not None}
    return IntegrityFinding("attachments", message, RESTORE, named)
