"""The content of attached files in the store: written once under its SHA-256, and read back whole
or not at all.

A content lies in pieces of a mebibyte, as chunks of series do: a copy of the store and its checks
hold a few of them at a time, whatever the file's size.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator

from sqlalchemy import Connection, select
from sqlalchemy.orm import Session

from ..files.media_types import MediaType, media_type_of
from .attachments import PICTURE_TYPES, AttachedContent, AttachedPiece

#: The largest file that is taken: a photograph has 5 to 20 MB, a certificate less.
MOST_BYTES = 50_000_000
#: Pixels of a picture that pages and reports show: 60 million take 240 MB where they are decoded.
#: A larger picture, which a few bytes can claim to be, is kept and handed out as a file.
MOST_SHOWN_PIXELS = 60_000_000
PIECE_BYTES = 2**20


class AttachedFileError(ValueError):
    """The content of an attached file is not what was attached; the message says what is wrong."""


def is_shown(content: AttachedContent) -> bool:
    """Whether pages and reports may show it as a picture.

    Parameters:
        content: The row of the content.
    """
    pixels = (content.width_px or 0) * (content.height_px or 0)
    return content.media_type in PICTURE_TYPES and 0 < pixels <= MOST_SHOWN_PIXELS


def checked_media_type(content: bytes) -> MediaType:
    """What a new file is.

    Parameters:
        content: The bytes of the file.

    Raises:
        ValueError: For a file that is empty, too large, or of no kind that is taken.
    """
    if len(content) > MOST_BYTES:
        raise ValueError(
            f"it has {len(content):,} bytes; expected at most {MOST_BYTES:,}: make the "
            "picture smaller, or divide the document"
        )
    return media_type_of(content)


def store_content(session: Session, content: bytes) -> AttachedContent:
    """The row of a content: the one that is there, or a new one with its pieces.

    Parameters:
        session: A session of `Store.write`, which runs again where another client has stored the
            same content meanwhile.
        content: The bytes of the file.

    Raises:
        ValueError: As `checked_media_type`.
        AttachedFileError: Where the store holds this content already, and it is damaged.
    """
    kind, sha256 = checked_media_type(content), hashlib.sha256(content).hexdigest()
    row = session.scalar(select(AttachedContent).where(AttachedContent.sha256 == sha256))
    if row is not None:
        read_content(session.connection(), row)
        return row
    row = AttachedContent(
        sha256=sha256,
        size_bytes=len(content),
        media_type=kind.name,
        width_px=kind.width_px,
        height_px=kind.height_px,
    )
    session.add(row)
    session.flush()
    for number, start in enumerate(range(0, len(content), PIECE_BYTES)):
        piece = content[start : start + PIECE_BYTES]
        session.add(AttachedPiece(content_id=row.id, number=number, data=piece))
    session.flush()
    return row


def read_content(connection: Connection, content: AttachedContent) -> bytes:
    """The bytes of a file, which are those that were attached.

    Parameters:
        connection: A connection to the store.
        content: The row of the content.

    Raises:
        AttachedFileError: Where a piece is missing or altered.
    """
    whole = b"".join(iter_pieces(connection, content.id, content.size_bytes))
    computed = hashlib.sha256(whole).hexdigest()
    if computed != content.sha256:
        raise AttachedFileError(
            f"the content of the attached file has the SHA-256 {computed[:12]}…, attached was "
            f"{content.sha256[:12]}…: it was altered in the store; restore the store from its "
            "backup (pyroshock db check names all damage)"
        )
    return whole


def iter_pieces(connection: Connection, content_id: int, size_bytes: int) -> Iterator[bytes]:
    """The pieces of a content in their order, one at a time in memory.

    Parameters:
        connection: A connection to the store.
        content_id: The key of the content's row.
        size_bytes: The size that its row says.

    Raises:
        AttachedFileError: Where a piece is missing, too many, or of another length.
    """
    rest = size_bytes
    for number in range(-(-size_bytes // PIECE_BYTES)):
        data = connection.scalar(
            select(AttachedPiece.data).where(
                AttachedPiece.content_id == content_id, AttachedPiece.number == number
            )
        )
        if data is None:
            raise AttachedFileError(f"piece {number} of the attached file is missing")
        expected = min(rest, PIECE_BYTES)
        if len(data) != expected:
            raise AttachedFileError(
                f"piece {number} of the attached file has {len(data):,} bytes; expected "
                f"{expected:,}"
            )
        rest -= expected
        yield bytes(data)
