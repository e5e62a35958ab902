"""Rows of people in a store: a user with a password, a token and an account at an identity
provider, what was changed, and what was written beside the rows."""

from __future__ import annotations

from datetime import UTC, datetime

from pyroshock.app.operations.people.stored_users import add_user, hash_of_token, new_token
from pyroshock.schema.attached_files import store_content
from pyroshock.schema.attachments import Attachment
from pyroshock.schema.audit import AuditRow
from pyroshock.schema.notes import Note, SavedFilter, Tag
from pyroshock.schema.person_roles import ENGINEER, READER, SYSTEM, USER
from pyroshock.schema.sign_on_identities import SignOnIdentity
from pyroshock.schema.users import PersonalToken
from sqlalchemy.orm import Session

WHEN = datetime(2026, 1, 7, tzinfo=UTC)
#: The smallest picture: GIF, one pixel by one.
PICTURE = bytes.fromhex(
    "47494638396101000100800000000000ffffff21f90401000000002c00000000010001000002024401003b"
)
NAME, PASSWORD = "anna", "four quiet grey herons"


def add_people_rows(session: Session, subject: str) -> None:
    """A row at least of each table; what is written and attached is about the campaign
    `subject`."""
    user = add_user(session, NAME, ENGINEER, PASSWORD)
    session.add(
        PersonalToken(
            user_id=user.id,
            label="plots",
            role=READER,
            sha256=hash_of_token(new_token()),
            made_at=WHEN,
        )
    )
    session.add(
        SignOnIdentity(
            user_id=user.id,
            login="anna@lab.example",
            issuer="https://login.lab.example",
            subject="7",
            invited_at=WHEN,
            bound_at=WHEN,
        )
    )
    session.add(
        AuditRow(
            happened_at=WHEN,
            person=NAME,
            person_kind=SYSTEM,
            operation="extract",
            subject=subject,
            request={"campaign": subject},
            outcome="failed",
            message="the disk is full",
            job=1,
        )
    )
    author = {"author": NAME, "author_kind": USER}
    about = {"subject_kind": "campaign", "subject": subject, **author}
    first = Note(**about, text="the plate was loose", written_at=WHEN)
    session.add(first)
    session.flush()
    session.add(Note(**about, first_id=first.id, text="the plate was firm", written_at=WHEN))
    session.add(Note(**about, first_id=first.id, reason="another campaign", written_at=WHEN))
    session.add(
        Attachment(
            **about,
            content_id=store_content(session, PICTURE).id,
            file_name="plate.gif",
            caption="the plate",
            attached_at=WHEN,
            removed_at=WHEN,
            removed_by=NAME,
            removed_by_kind=USER,
            removal_reason="another plate",
        )
    )
    session.add(Tag(**about, word="doubtful", tagged_at=WHEN))
    session.add(
        SavedFilter(**author, name="hard hits", page="/impacts", filter="where=x>1", saved_at=WHEN)
    )
