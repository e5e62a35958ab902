"""What a store's database is asked."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from pyroshock.schema.session import Store
from sqlalchemy import event


@contextmanager
def statements(store: Store) -> Iterator[list[str]]:
    """The list fills with the statements that are sent; one for many rows is one."""
    said: list[str] = []

    def note(_connection: Any, _cursor: Any, statement: str, *_: Any) -> None:
        said.append(statement)

    event.listen(store.engine, "before_cursor_execute", note)
    try:
        yield said
    finally:
        event.remove(store.engine, "before_cursor_execute", note)
