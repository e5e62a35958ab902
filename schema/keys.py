"""Rows that many writers share: found by their natural key, or added once."""

from __future__ import annotations

import hashlib
import json
from typing import Any, TypeVar

from sqlalchemy import select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from .base import Base

Row = TypeVar("Row", bound=Base)


def fingerprint_of(content: object) -> str:
    """SHA-256 of JSON content, whatever the order of its keys: the natural key of rows that are sets of values."""
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def get_or_add(session: Session, model: type[Row], key: dict[str, Any], values: dict[str, Any] | None = None) -> Row:
    """The row of `model` with this unique `key`, added with `values` where there is none.

    Safe against another process that adds it at the same moment: the loser of the race reads the winner's row.
    """
    query = select(model).filter_by(**key)
    existing_key = session.scalars(query).one_or_none()
    if existing_key is not None:
        return existing_key
    try:
        with session.begin_nested():
            row = model(**key, **(values or {}))
            session.add(row)
            session.flush()
        return row
    except IntegrityError:
        winner = session.scalars(query).one_or_none()
        if winner is None:
            raise  # another rule was broken, not the key's
        return winner
