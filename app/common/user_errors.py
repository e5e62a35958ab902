"""Errors that a person can mend, told from bugs of ours.

Where the store is when nobody says so: in the folder that a person works in.
"""

from __future__ import annotations

from sqlalchemy.exc import SQLAlchemyError

from ...schema.engine import MAKE_ROOM, StoreError, disk_is_full


def is_for_the_user(error: Exception) -> bool:
    """Whether the words of an error help who asked; a bug of ours does not."""
    # ValueError and LookupError are how our libraries refuse an argument; a bug of ours shows its traceback.
    if type(error) in (ValueError, LookupError) or isinstance(error, StoreError | OSError | SQLAlchemyError):
        return True
    return isinstance(error, ValueError | LookupError) and type(error).__module__.startswith("pyroshock")


def words_of(error: Exception) -> str:
    """What to tell of it."""
    message = str(error)
    return f"{message}; {MAKE_ROOM}" if disk_is_full(error) and "make room" not in message else message


DEFAULT_DB = "sqlite:///pyroshock.db"
