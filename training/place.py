"""Where models live: MLflow's store, the files of the models, the folder of work in progress."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError

#: By which MLflow, and we with it, are told of another place.
VARIABLE = "MLFLOW_TRACKING_URI"


@dataclass(frozen=True)
class Place:
    """`tracking_uri` of MLflow's store; `folder` for models' files and, in `work`, for what is in progress.

    A tracking server keeps models' files itself: `artifact_uri` is None then.
    """

    tracking_uri: str
    folder: Path

    @property
    def artifact_uri(self) -> str | None:
        """Absolute: MLflow would take a relative one from whatever folder it is called in."""
        return None if self.is_server else self.folder.absolute().as_uri()

    @property
    def is_server(self) -> bool:
        return self.tracking_uri.startswith(("http://", "https://"))

    @property
    def shown(self) -> str:
        """The address for a message: without its password."""
        return self.tracking_uri if self.is_server else make_url(self.tracking_uri).render_as_string(hide_password=True)

    @property
    def work(self) -> Path:
        return self.folder / "work"

    @property
    def lock(self) -> Path:
        """Of this store, so that another store's work does not wait for it."""
        return self.work / f"{hashlib.sha256(self.tracking_uri.encode()).hexdigest()[:16]}.lock"

    @property
    def database(self) -> Path | None:
        """The file of an SQLite store."""
        if not self.tracking_uri.startswith("sqlite"):
            return None
        return Path(make_url(self.tracking_uri).database or "")


def place_beside(store_url: str, environment: Mapping[str, str]) -> Place:
    """Where the models of the store at `store_url` live.

    `MLFLOW_TRACKING_URI` decides where it is set. Else `lab.db` has `lab-models.db` and `lab-models/` beside it, and a
    server's store has `pyroshock-models.db` and `pyroshock-models/` in the current folder. Raises `ValueError` for a
    folder as tracking URI, which MLflow no longer takes, and for a URI that is none.
    """
    given = environment.get(VARIABLE)
    if given:
        if given == store_url:
            raise ValueError(f"{VARIABLE} is the store's own database; MLflow's tables need one of their own")
        return _given(given)
    database = _database(store_url)
    stem = database.with_name(f"{database.stem}-models") if database else Path.cwd() / "pyroshock-models"
    return Place(f"sqlite:///{stem.with_name(stem.name + '.db')}", stem)


def _given(uri: str) -> Place:
    if uri.startswith(("http://", "https://")):
        return Place(uri, Path.cwd() / "pyroshock-models")
    try:
        scheme = make_url(uri).drivername
    except ArgumentError:
        scheme = "file"
    if scheme == "file":
        raise ValueError(
            f"{VARIABLE}={uri}: MLflow keeps no models in plain folders any more; "
            "give sqlite:///FILE, postgresql+psycopg://USER@HOST/NAME or a server's address"
        )
    database = _database(uri)
    if database is None:
        return Place(uri, Path.cwd() / "pyroshock-models")
    return Place(f"sqlite:///{database}", database.with_suffix(""))


def _database(url: str) -> Path | None:
    """The file of an SQLite address, absolute; None for a server's, and for one in memory."""
    parsed = make_url(url)
    if parsed.get_backend_name() != "sqlite" or parsed.database in (None, "", ":memory:"):
        return None
    return Path(str(parsed.database)).absolute()
