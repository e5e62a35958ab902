"""The laboratory that an operation works in: its open store, and where models and processes are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from ...parallel.executor import ExecutorConfig
from ...schema.person_roles import Person, system_person

if TYPE_CHECKING:
    from ...schema.session import Store
    from ..twins.building import BuiltTwin, TwinRequest
    from ..twins.twin_cache import TwinCache


@dataclass(frozen=True)
class Laboratory:
    """`db` is the address of the store, beside which models and solved plates lie.

    `folders` are those that a request from the network may name; None: any folder of this machine.
    `processes` read files at once (None: as many as pay), and `job` is the number of the job that
    does the work, 0 of none. `tell` takes remarks while the work goes on, for whoever waits for it.
    """

    store: Store
    db: str
    executor: ExecutorConfig = field(default_factory=ExecutorConfig)
    folders: tuple[Path, ...] | None = None
    processes: int | None = None
    job: int = 0
    tell: Callable[[str], None] = lambda _: None
    #: Those that stay ready between requests, where some do.
    twins: TwinCache | None = None

    @property
    def person(self) -> Person:
        """Who asks: the person that the store's writer speaks for, else whoever runs this process,
        who may do what the store lets them do."""
        # An operation that opens the store itself, as an upgrade does, is given none.
        writer = getattr(self.store, "writer", None)
        return system_person() if writer is None else writer.person or system_person()

    def twin(self, request: TwinRequest) -> BuiltTwin:
        """The twin that is asked for. Raises as `twins.building.twin_of`."""
        from ..common.model_registry import models_extra
        from ..twins.building import twin_of

        if self.twins is not None and request.bench is None and request.modes is None:
            return self.twins.get(request)
        with models_extra():
            return twin_of(self.store, self.db, request)
