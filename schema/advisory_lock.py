"""Turns: writers that read what they then change go one after the other, and others go on meanwhile.

SQLite lets one write at a time, so its writers take turns as it is. PostgreSQL's advisory locks are had by number; it
releases them with the transaction or the connection that took them, however that ends.
"""

from __future__ import annotations

import hashlib

from sqlalchemy import func, select
from sqlalchemy.orm import Session


def take_turn(session: Session, what: str) -> None:
    """Wait until nobody else's transaction has the turn called `what`; it is ours until our transaction ends.

    Take it first: what was read before it may have changed while waiting. One turn a transaction, or two transactions
    may wait for each other.
    """
    if session.get_bind().dialect.name == "postgresql":
        session.execute(select(func.pg_advisory_xact_lock(number_of(what))))


def number_of(what: str) -> int:
    """The name as PostgreSQL knows it: 64 bits with a sign."""
    return int.from_bytes(hashlib.sha256(f"pyroshock {what}".encode()).digest()[:8], signed=True)
