"""How much of a store is looked at."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ..progress import ProgressBar

#: A select of any columns, whose types SQLAlchemy's versions write differently.
Query = Any

#: Restoring is right whatever was damaged, and often all that is left.
RESTORE = "restore the store from its backup (docs/reference/store.md)"


@dataclass(frozen=True)
class Scope:
    """One campaign by its key, or the whole store (None); `bar` is told of what takes time."""

    campaign: int | None = None
    bar: ProgressBar = field(default_factory=lambda: ProgressBar(None, 0))

    def within(self, query: Query, campaign: Any) -> Query:
        """The query's rows of this scope, by its column that holds the campaign's key."""
        return query if self.campaign is None else query.where(campaign == self.campaign)
