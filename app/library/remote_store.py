"""The experiment store behind a server: the library with the address of a laboratory.

Methods, arguments and results are those of `ExperimentStore`. What goes through an operation is
asked by `ServerAnswers`; here stands what reads arrays, and what stays on the server.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

from ..common.errors import InvalidValueError, StorageError, library_errors, raises_library_errors
from ..common.frames import titled_table
from ..doors.python import with_arguments_of
from ..operations.faults import read_arguments
from ..operations.predict.request import TwinOptions
from .experiment_store import ExperimentStore
from .plans import PlanCollection
from .server_answers import ServerAnswers, text_values
from .server_connection import connect, part

if TYPE_CHECKING:
    import pandas as pd

    from ...array_types import Floats
    from ...dataset.snapshot import Snapshot
    from ...doe.plans import StoredPlan
    from ..doors.job_handle import JobSource
    from ..doors.python import Answers
    from ..operations.impacts.listing import SelectedRows
    from ..operations.impacts.service import ForcePulse, StoredRecording
    from ..operations.train.contact_model import StoredModel
    from .laboratory_twin import LaboratoryTwin
    from .server_connection import ServerConnection

#: Of one request; a longer recording is read in several.
_SAMPLES_AT_ONCE = 4_000_000


class RemoteStore(ExperimentStore):
    """An experiment store behind a server: the same methods, arguments and results.

    Long work is a job of the server, which goes on where this Python ends. `store` is not there:
    the database is the server's alone.
    """

    answers: ServerAnswers

    def __init__(self, connection: ServerConnection) -> None:
        self.url = connection.address
        self.answers = ServerAnswers(connection)

    def __getattr__(self, name: str) -> Any:
        if name == "store":
            raise AttributeError(
                f"the database of {self.url} is the server's alone; open it by its own address for "
                "`store`"
            )
        raise AttributeError(f"an experiment store has no attribute {name!r}")

    @property
    def plan(self) -> PlanCollection:
        """The plans of campaigns, and the methods to make one."""
        return RemotePlans(self.answers)

    def close(self) -> None:
        """End the connection to the server."""
        self._connection.close()

    @property
    def _connection(self) -> ServerConnection:
        return self.answers.connection

    def _job_source(self) -> JobSource:
        return self.answers

    # --- what is read as a whole

    def _campaign_rows(self, tag: str | None) -> Sequence[Mapping[str, Any]]:
        parameters = {} if tag is None else {"tag": tag}
        return _rows(self._connection.read("/api/library/campaigns", parameters).rows)

    def _impacts(
        self, selection: SelectedRows, limit: int | None, named: Sequence[str]
    ) -> pd.DataFrame:
        query = {
            "campaign": selection.campaign,
            "where": selection.where,
            "limit": limit,
            "named": tuple(named),
        }
        frame: pd.DataFrame = self._read("/api/library/impacts", query)
        return frame

    def _shot_rows(self, selection: SelectedRows) -> Sequence[Mapping[str, Any]]:
        query = {"campaign": selection.campaign, "where": selection.where}
        return _rows(self._read("/api/library/shots", query).rows)

    def _diagnosis_rows(self, campaign: str | None) -> Sequence[Mapping[str, Any]]:
        return _rows(self._read("/api/library/diagnoses", {"campaign": campaign}))

    def _snapshot(self, name: str) -> Snapshot:
        snapshot: Snapshot = self._connection.read(f"/api/library/datasets/{part(name)}")
        return snapshot

    def _read(self, path: str, query: Mapping[str, Any]) -> Any:
        return self._connection.read(path, text_values(query))

    @raises_library_errors
    def pulse(self, impact: int) -> ForcePulse:
        """The contact force of an impact: the pulse in use."""
        pulse: ForcePulse = self._connection.read(f"/api/library/pulses/{_key(impact, 'impact')}")
        return pulse

    @raises_library_errors
    def recording(self, impact: int) -> StoredRecording:
        """The recording of an impact, whose samples are read when they are used."""
        from ..operations.impacts.service import StoredChannel, StoredRecording

        described = self._connection.read(f"/api/library/recordings/{_key(impact, 'impact')}")
        channels = [StoredChannel(facts, self._samples) for facts in described["channels"]]
        return StoredRecording(impact, described["path"], channels)

    def _samples(self, channel: int, first: int, stop: int) -> Floats:
        import numpy as np

        slices = []
        for start in range(first, stop, _SAMPLES_AT_ONCE):
            end = min(start + _SAMPLES_AT_ONCE, stop)
            samples = self._connection.array(
                f"/api/channels/{channel:d}/samples", {"first": start, "stop": end}
            )
            if samples.shape != (end - start,) or samples.dtype != np.float64:
                raise StorageError(
                    f"{self.url} has sent {samples.shape} {samples.dtype} for the samples {start} "
                    f"to {end} of channel {channel}"
                )
            slices.append(samples)
        if len(slices) == 1:
            return slices[0]
        return np.concatenate(slices) if slices else np.empty(0)

    @raises_library_errors
    def query(self, statement: str, **settings: Any) -> pd.DataFrame:
        """The answer to one SELECT statement in SQL, which cannot change anything. A server gives
        at most 100,000 rows; more are refused, unless `limit` says that so many are enough."""
        from ..operations.store.question import MOST_ROWS

        if settings.get("limit") is not None:
            return super().query(statement, **settings)
        frame = super().query(statement, **{**settings, "limit": MOST_ROWS})
        if len(frame) == MOST_ROWS:
            raise InvalidValueError(
                f"the answer has {MOST_ROWS:,} rows or more, which is all that a server gives; ask "
                "for less, or give limit"
            )
        return frame

    @raises_library_errors
    def jobs(self, *, limit: int | None = None) -> pd.DataFrame:
        """The long work that was asked for, the newest first: at most `limit` jobs, by default
        20."""
        return super().jobs(limit=20 if limit is None else limit)

    # --- what stays on the server

    @raises_library_errors
    def model(self, name: str, *, split: str | None = None) -> StoredModel:
        """A registered model, which predicts on the server."""
        from ..operations.train.contact_model import StoredModel
        from .remote_models import RemoteModel

        described = self._read(f"/api/library/models/{part(name)}", {"split": split})
        version, predictors, shots = (described[key] for key in ("version", "predictors", "shots"))
        return StoredModel(RemoteModel(self._connection, version, predictors, shots))

    @with_arguments_of(TwinOptions)
    @raises_library_errors
    def twin(self, **options: Any) -> LaboratoryTwin:
        """The twin of a campaign's bench (without one, the newest of a gun), which the server
        builds and keeps."""
        from .remote_models import remote_twin

        return remote_twin(self.answers, read_arguments(TwinOptions, options))

    def __repr__(self) -> str:
        return f"<experiment store {self.url}>"

    def _repr_html_(self) -> str:
        return titled_table(f"experiment store {escape(self.url)}", self.campaigns())


class RemotePlans(PlanCollection):
    """The plans of a store behind a server."""

    def __init__(self, answers: ServerAnswers) -> None:
        self.answers: Answers = answers
        self._connection, self.url = answers.connection, answers.connection.address

    def _rows(self) -> Sequence[Mapping[str, Any]]:
        return _rows(self._connection.read("/api/library/plans"))

    def _plan(self, name: str) -> StoredPlan:
        plan: StoredPlan = self._connection.read(f"/api/library/plans/{part(name)}")
        return plan


def open_remote_store(address: str, token: str | None = None) -> RemoteStore:
    """The store behind a server.

    Parameters:
        address: The address of the server, "http://lab:8000".
        token: The server's token; by default the variable PYROSHOCK_TOKEN.

    Raises:
        InvalidValueError: For what is no address of a server.
        StorageError: For a server that does not answer, is another program or admits nobody.
    """
    with library_errors():
        return RemoteStore(connect(address, token))


def _rows(value: Any) -> Sequence[Mapping[str, Any]]:
    if not isinstance(value, list) or not all(isinstance(row, Mapping) for row in value):
        raise StorageError("the server has sent something else than rows")
    return value


def _key(number: int, name: str) -> int:
    if isinstance(number, bool) or not isinstance(number, int) or not 0 < number < 2**31:
        raise LookupError(f"no {name} {number} in the store; pyroshock impacts lists them")
    return number
