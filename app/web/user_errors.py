"""Errors that a person can mend, and what HTTP calls them."""

from __future__ import annotations

from sqlalchemy.exc import DataError, SQLAlchemyError

from ...schema.engine import StoreError


def is_for_the_user(error: Exception) -> bool:
    """Whether the words of an error help who asked; a bug of ours does not."""
    if type(error) in (ValueError, LookupError) or isinstance(error, StoreError | OSError | SQLAlchemyError):
        return True
    return isinstance(error, ValueError | LookupError) and type(error).__module__.startswith("pyroshock")


def status_of(error: Exception) -> int:
    """404 what is not there, 422 what cannot be used, 503 a store or a disk that fails."""
    if isinstance(error, LookupError):
        return 404
    return 422 if isinstance(error, ValueError | DataError) else 503
