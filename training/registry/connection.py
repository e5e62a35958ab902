"""The way to MLflow's store: quiet, ready to be used, and without a trace in the process' own
settings."""

from __future__ import annotations

import logging
import os
import sqlite3
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from functools import wraps
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from sqlalchemy.exc import DatabaseError

from ...schema.addresses import without_secrets
from ...schema.transactions import is_transient, retry
from .locks import exclusive_lock
from .mlflow_tables import known_tables
from .model_storage import VARIABLE, ModelStorage
from .reader import ClientReader, RegistryReader

if TYPE_CHECKING:
    from mlflow import MlflowClient

Asked = ParamSpec("Asked")
Answer = TypeVar("Answer")

#: In which everything of ours is logged.
EXPERIMENT = "pyroshock"

#: No figures sent home, no pip run for each model, no progress bars, no addresses printed.
_QUIET = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "DO_NOT_TRACK": "true",
    "MLFLOW_SKIP_PIP_REQUIREMENTS_CHECK": "true",
    "MLFLOW_UV_AUTO_DETECT": "false",
    "MLFLOW_ENABLE_ARTIFACTS_PROGRESS_BAR": "false",
    "MLFLOW_SUPPRESS_PRINTING_URL_TO_STDOUT": "true",
    "GIT_PYTHON_REFRESH": "quiet",
}


#: The address of MLflow's store is the process's: threads of a server take turns.
_TURN = threading.RLock()


def user_environment() -> dict[str, str]:
    """The process's variables as the user set them: waits while another thread's client has its own
    store in them."""
    with _TURN:
        return dict(os.environ)


class RegistryError(ValueError):
    """The registry cannot be used, or does not hold what is asked for."""


class Connection:
    """To the store at a place. `experiment` is known once a client was had."""

    def __init__(self, place: ModelStorage) -> None:
        self.place = place
        self.experiment: str | None = None

    @property
    def nothing_there(self) -> bool:
        """Whether the store is a file that nobody has made yet."""
        database = self.place.database
        return database is not None and not database.is_file()

    @contextmanager
    def reading(self) -> Iterator[RegistryReader]:
        """A reader of this place's store: of its tables where they are known, else of MLflow."""
        with self._errors_as_ours(), known_tables(self.place, EXPERIMENT) as tables:
            if tables is not None:
                yield tables
                return
        with self.client() as client:
            yield self.reader_of(client)

    def reader_of(self, client: MlflowClient) -> RegistryReader:
        """A reader for one who writes with this client."""
        assert self.experiment is not None
        return ClientReader(client, self.experiment)

    @contextmanager
    def client(self) -> Iterator[MlflowClient]:
        """A client of this place's store; MLflow's own settings are as before afterwards, its
        errors one of ours."""
        os.environ.update(_QUIET)
        with _TURN, self._errors_as_ours(), warnings.catch_warnings():
            warnings.simplefilter(
                "ignore"
            )  # of MLflow's own dependencies, and of what it would have us log
            before = os.environ.get(VARIABLE)
            import mlflow
            from mlflow.exceptions import MlflowException

            for name in ("mlflow", "alembic"):
                logging.getLogger(name).setLevel(logging.ERROR)
            # It prints the trace of what it then raises, be it that a second try succeeds.
            logging.getLogger("mlflow.store.db.utils").setLevel(logging.CRITICAL)
            mlflow.set_tracking_uri(self.place.tracking_uri)
            mlflow.set_registry_uri(self.place.tracking_uri)
            # MLflow writes it into the variable as well, where other threads would take it for the
            # user's.
            _restore_variable(before)
            try:
                if self.experiment is None:
                    self._refuse_damaged()
                    self.experiment = self._made_ready()
                yield mlflow.MlflowClient()
            except MlflowException as error:
                raise RegistryError(
                    f"model registry {self.place.shown}: {_first_line(error)}"
                ) from error
            finally:
                mlflow.set_registry_uri(None)
                mlflow.set_tracking_uri(None)
                _restore_variable(before)

    @contextmanager
    def _errors_as_ours(self) -> Iterator[None]:
        """An error of the database as one of ours, unless it passes by itself."""
        try:
            yield
        except (DatabaseError, sqlite3.DatabaseError) as error:
            if is_transient(error):
                raise
            raise RegistryError(
                f"model registry {self.place.shown} cannot be read: {_first_line(error)}; "
                "restore it from a backup (pyroshock db restore), or move it away and register "
                "its files again (pyroshock models recover)"
            ) from error

    def _refuse_damaged(self) -> None:
        """Raise `sqlite3.DatabaseError` for a file that is cut or no database: MLflow tries to open
        it for minutes."""
        if self.place.database is None or self.nothing_there:
            return
        with (
            suppress(sqlite3.OperationalError),
            closing(sqlite3.connect(self.place.database)) as connection,
        ):
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()

    def _made_ready(self) -> str:
        """The experiment; the first call makes MLflow's tables, and two at once would stumble over
        each other."""
        import mlflow

        if not self.place.is_server:
            # takes a second, for which nobody should wait in turn
            import mlflow.store.tracking.sqlalchemy_store
        with exclusive_lock(self.place, "tables"):
            client = mlflow.MlflowClient()
            experiment = client.get_experiment_by_name(EXPERIMENT)
            if experiment is not None:
                return str(experiment.experiment_id)
            return str(
                client.create_experiment(EXPERIMENT, artifact_location=self.place.artifact_uri)
            )


def _restore_variable(before: str | None) -> None:
    if before is None:
        os.environ.pop(VARIABLE, None)
    else:
        os.environ[VARIABLE] = before


def patient(method: Callable[Asked, Answer]) -> Callable[Asked, Answer]:
    """A method that finds its own traces, called again where the store was lost or another one's
    lock stood before."""

    @wraps(method)
    def called(*args: Asked.args, **kwargs: Asked.kwargs) -> Answer:
        return retry(lambda: method(*args, **kwargs), lambda error, _: is_transient(error))

    return called


def _first_line(error: Exception) -> str:
    """The first that says what failed: SQLAlchemy puts a remark on its own doing before it."""
    lines = str(error).strip().splitlines()
    return without_secrets(
        next((line for line in lines if not line.startswith("(raised as a result of")), lines[0])
    )
