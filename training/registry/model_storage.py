"""Where models live: MLflow's store, the files of the models, the folder of work in progress."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit

from ...schema.addresses import (
    AddressError,
    address_for_display,
    parse_address,
    parse_store_address,
)

if TYPE_CHECKING:
    from sqlalchemy import URL

#: By which MLflow, and we with it, are told of another place.
VARIABLE = "MLFLOW_TRACKING_URI"
#: By which we are told where models' files go: a folder, or an address that MLflow knows (s3://..).
FILES = "PYROSHOCK_MODELS"


@dataclass(frozen=True)
class ModelStorage:
    """`tracking_uri` of MLflow's store; `folder` for models' files and, in `work`, for what is in
    progress.

    Models' files go to `files` where it is given. A tracking server keeps them itself:
    `artifact_uri` is None then.
    """

    tracking_uri: str = field(repr=False)
    folder: Path
    files: str | None = None

    @property
    def artifact_uri(self) -> str | None:
        """Absolute: MLflow would take a relative one from whatever folder it is called in."""
        return None if self.is_server else self.files or self.folder.absolute().as_uri()

    @property
    def is_server(self) -> bool:
        return self.tracking_uri.startswith(("http://", "https://"))

    @property
    def is_postgresql(self) -> bool:
        """A store that several machines may share, without a tracking server before it."""
        return self.tracking_uri.startswith("postgresql")

    @property
    def shown(self) -> str:
        """The address for a message: without its password."""
        return address_for_display(self.tracking_uri)

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
        return Path(parse_address(self.tracking_uri).database or "")


def storage_for(store_url: str, environment: Mapping[str, str]) -> ModelStorage:
    """Where the models of a store live.

    Parameters:
        store_url: The address of the store. `lab.db` has `lab-models.db` and `lab-models/` beside
            it; the store of a server has `pyroshock-models.db` and `pyroshock-models/` in the
            current folder.
        environment: Variables by name. `MLFLOW_TRACKING_URI` decides in the place of the store's
            address where it is set; `PYROSHOCK_MODELS` decides where models' files go.

    Raises:
        ValueError: For a folder as tracking URI, which MLflow no longer takes, for a URI that is
            none, and for the store's own database as tracking URI.
    """
    return _with_files(_storage_of(store_url, environment.get(VARIABLE)), environment.get(FILES))


def _with_files(place: ModelStorage, given: str | None) -> ModelStorage:
    if not given:
        return place
    if "://" in given and not given.startswith("file://"):
        return replace(place, files=given)
    folder = Path(unquote(urlsplit(given).path)) if given.startswith("file://") else Path(given)
    return replace(place, folder=folder.absolute())


def _storage_of(store_url: str, given: str | None) -> ModelStorage:
    if given:
        if given == store_url:
            raise ValueError(
                f"{VARIABLE} is the store's own database; MLflow's tables need one of their own"
            )
        return _storage_at(given)
    database = _file_of(parse_store_address(store_url))
    stem = (
        database.with_name(f"{database.stem}-models")
        if database
        else Path.cwd() / "pyroshock-models"
    )
    return ModelStorage(_sqlite_uri(stem.with_name(stem.name + ".db")), stem)


def _storage_at(uri: str) -> ModelStorage:
    if uri.startswith(("http://", "https://")):
        return ModelStorage(uri, Path.cwd() / "pyroshock-models")
    try:
        scheme = parse_address(uri).drivername
    except AddressError:
        if "://" in uri:
            raise
        scheme = "file"
    if scheme == "file":
        raise ValueError(
            f"{VARIABLE}={address_for_display(uri)}: MLflow keeps no models in plain folders any "
            "more; give sqlite:///FILE, postgresql+psycopg://USER@HOST/NAME or a server's address"
        )
    database = _file_of(parse_address(uri))
    if database is None:
        return ModelStorage(uri, Path.cwd() / "pyroshock-models")
    return ModelStorage(_sqlite_uri(database), database.with_suffix(""))


def _sqlite_uri(database: Path) -> str:
    """As MLflow reads it, which decodes %20 and takes what follows a ? for options."""
    from sqlalchemy import URL

    return URL.create("sqlite", database=str(database)).render_as_string()


def _file_of(address: URL) -> Path | None:
    """The file of an SQLite address, absolute; None for a server's, and for one in memory."""
    if address.get_backend_name() != "sqlite" or address.database in (None, "", ":memory:"):
        return None
    return Path(str(address.database)).absolute()
