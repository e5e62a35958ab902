"""What HTTP calls the errors that a person can mend."""

from __future__ import annotations

from sqlalchemy.exc import DataError

from ...schema.engine import StoreRoleError


def status_of(error: Exception) -> int:
    """403 what the login's role may not, 404 what is not there, 422 what cannot be used, 503 a store or a disk that
    fails."""
    if isinstance(error, StoreRoleError):
        return 403
    if isinstance(error, LookupError):
        return 404
    return 422 if isinstance(error, ValueError | DataError) else 503
