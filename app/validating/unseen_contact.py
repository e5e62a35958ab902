"""A registered model as it would be without some configurations: what it learned from them is taken out of it."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...dataset.build_table import configuration_text
from ...dataset.rows import levels_of
from ...dataset.snapshot import SnapshotError, read_snapshot
from ...training.evaluation.unseen_configurations import without_configurations
from ...training.fitting.fitting import rng_of

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...dataset.table import PulseTable
    from ...schema.session import Store
    from ...training.models.contact_stage import RegisteredContact

#: What a prediction's model had seen of the shots that it is compared with.
NOTHING, REFITTED, SEEN = "nothing", "refitted", "seen"


@dataclass(frozen=True, eq=False)
class UnseenContact:
    """Takes configurations out of the registered model of `contact`, whose version is in the registry beside `db`."""

    store: Store
    db: str
    contact: RegisteredContact

    def without(self, configurations: Sequence[int]) -> tuple[RegisteredContact, str]:
        """The model refitted to the pulses of all other configurations, in whatever campaign they were recorded.

        And what it had seen: `NOTHING` where it had learned from none of these configurations and is as it was,
        `REFITTED`, or `SEEN` where it cannot be refitted (its pulses are gone, or nothing would be left). What a model
        tuned on all its pulses (length scales, widths of bands) is kept.
        """
        if self._learned is None:
            return self.contact, SEEN
        with self.store.reading() as session:
            names = configuration_names(session, configurations)
        registered = self.contact.registered
        version = registered.version
        rng = rng_of("validate", version.dataset.hash, version.split, version.seed)
        try:
            model = without_configurations(registered.model, self._learned, list(names), rng)
        except ValueError:
            return self.contact, SEEN
        if model is registered.model:
            return self.contact, NOTHING
        return replace(self.contact, registered=replace(registered, model=model)), REFITTED

    @cached_property
    def _learned(self) -> PulseTable | None:
        """The pulses that the model was trained on; None where the store has them no longer."""
        from ..models.training import registry_of

        version = self.contact.registered.version
        keys = registry_of(self.db).held_out(version).trained_on
        try:
            with self.store.reading() as session:
                table = read_snapshot(session, version.dataset.hash).table
        except (LookupError, SnapshotError):
            return None
        return table.take(np.isin(table.key, keys))


def configuration_names(session: Session, configurations: Sequence[int]) -> Collection[str]:
    """Configurations of the store (by key) as a dataset names them."""
    return {configuration_text(words) for words, _ in levels_of(session, configurations).values()}
