"""The experiment store as notebooks use it: `ps.open(...)`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from ...schema.session import Store, Writer, open_store

if TYPE_CHECKING:
    from .plans import PlanCollection


class ExperimentStore:
    """Campaigns, impacts, plans, datasets, models and diagnoses of a laboratory, under one address.

    Use it in a `with` block, or call `close()`. Everything that is read comes back as a pandas DataFrame or as an
    object with `.to_frame()` and `.plot()`. Numbers are SI. `store` is the store of the database layer, for what has
    no method here.
    """

    def __init__(self, store: Store, url: str) -> None:
        self.store = store
        self.url = url

    @property
    def plan(self) -> PlanCollection:
        """The plans of campaigns, and the methods to make one: `store.plan.lhs("summer", runs=105)`."""
        from .plans import PlanCollection

        return PlanCollection(self.store)

    def close(self) -> None:
        """Release the connection to the database."""
        self.store.close()

    def __enter__(self) -> ExperimentStore:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_experiment_store(address: str | os.PathLike[str], *, create: bool = True) -> ExperimentStore:
    """The store at `address`: "sqlite:///lab.db", "postgresql+psycopg://USER@HOST/NAME", or the path of a file.

    An SQLite file that does not exist is made, unless `create` is False. Raises `StoreError` where it cannot be opened.
    """
    from ... import __version__

    text = str(address)
    url = text if "://" in text else f"sqlite:///{Path(address)}"
    return ExperimentStore(open_store(url, Writer("python", __version__), create=create), url)
