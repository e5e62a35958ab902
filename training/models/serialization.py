"""Models as files: `model.json` says what it is, `arrays.npz` holds what it learned.

Reading runs no code of the file's: kinds come from the list in `kinds`, numbers from npz without
pickle.

Every kind of model and estimator that may be read back from a file, and where its class stands; of
other packages those that they announce.
"""

from __future__ import annotations

import hashlib
import importlib
import io
import json
import re
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from ...plugins import MODELS, Loaded, Plugin, load
from ..estimators.base import Arrays, Estimator
from .base import ContactModel

#: Kind -> module under `training`, class. For a file's sake nothing else is ever imported but what
#: installed packages announce as an entry point of this name.
KINDS: dict[str, tuple[str, str]] = {
    "pair": ("models.pair", "Pair"),
    "single-pass": ("models.single_pass", "SinglePass"),
    "hybrid": ("models.hybrid", "Hybrid"),
    "calibrated": ("models.calibrated", "Calibrated"),
    "analytic": ("models.analytic", "Analytic"),
    "tree": ("estimators.trees", "DecisionTree"),
    "ensemble": ("estimators.trees", "TreeEnsemble"),
    "svr": ("estimators.support_vectors", "SupportVectors"),
    "svr-kernel": ("estimators.support_vectors", "SupportVectorKernel"),
    "kernel-ridge": ("estimators.linear", "KernelRidge"),
    "linear": ("estimators.linear", "LinearPowers"),
    "pls": ("estimators.linear", "PartialLeastSquares"),
    "network": ("estimators.network", "Network"),
    "genetic-network": ("estimators.genetic_network", "GeneticNetwork"),
    "coregional": ("estimators.coregional", "Coregional"),
    "single-outputs": ("estimators.single_outputs", "SingleOutputs"),
    "turned": ("estimators.rotated_outputs", "RotatedOutputs"),
    "contact-time": ("estimators.contact_time", "ContactTimeProcess"),
}

_ROOT = __package__.rpartition(".")[0]


class UnknownKindError(ValueError):
    """A file names a kind of model that this software does not have."""


def build(description: Mapping[str, Any]) -> ContactModel | Estimator:
    """The unfitted object of a description.

    Parameters:
        description: {"kind", "settings"} as `describe` gives it; a setting of that form is built
            first.

    Raises:
        UnknownKindError: For a kind that this software does not have.
        ValueError: For settings that the kind does not take.
    """
    kind = description["kind"]
    made = _class_of(kind)
    try:
        settings = description["settings"].items()
        built = made(**{key: build(value) if _is_part(value) else value for key, value in settings})
    except TypeError as error:
        raise ValueError(
            f"a model of kind {kind!r} does not take these settings: {error}"
        ) from error
    assert isinstance(built, ContactModel | Estimator)
    return built


def _class_of(kind: str) -> type[ContactModel] | type[Estimator]:
    if kind in KINDS:
        module, name = KINDS[kind]
        shipped: type[ContactModel] = getattr(importlib.import_module(f".{module}", _ROOT), name)
        return shipped
    added = added_kinds()
    if kind in added.objects:
        return added.objects[kind]
    if kind in added.failures:
        raise UnknownKindError(added.failures[kind])
    raise UnknownKindError(
        f"unknown kind of model {kind!r}; known: {', '.join([*KINDS, *added.objects])}; is "
        f"pyroshock up to date, and the package of the model installed (pyroshock plugins)?"
    )


@cache
def added_kinds() -> Loaded[type[ContactModel] | type[Estimator]]:
    """Those of other packages. Raises `PluginError` for a kind that is taken."""
    return load(MODELS, _accepted, KINDS)


def plugin_of(kind: str) -> Plugin | None:
    """The entry point of another package that adds a kind; None for one that is shipped.

    Parameters:
        kind: What a model or estimator is registered as, such as "coregional".
    """
    return None if kind in KINDS else added_kinds().plugins.get(kind)


#: The registry, comma lists and addresses of models take such a name.
_KIND_NAME = re.compile(r"[a-z][a-z0-9-]*")


def _accepted(name: str, made: Any) -> type[ContactModel] | type[Estimator]:
    """A model of another package that keeps the contract of `docs/how-to/extend.md`."""
    if not _KIND_NAME.fullmatch(name) or name in ("all", "usual"):
        raise ValueError(f"its name is {name!r}; expected small letters, digits and hyphens")
    if not (isinstance(made, type) and issubclass(made, ContactModel | Estimator)):
        raise TypeError(
            f"expected a class derived from pyroshock.training.estimators.base.Estimator or "
            f"pyroshock.training.models.base.ContactModel: {made!r}"
        )
    if getattr(made, "kind", None) != name:
        raise ValueError(f"its kind is {getattr(made, 'kind', None)!r}; expected {name!r}")
    if not made.description.strip():
        raise ValueError(f"{made.__name__}.description is empty; expected one sentence")
    json.dumps(made().settings(), allow_nan=False)
    return made


def describe(part: ContactModel | Estimator) -> dict[str, Any]:
    """The description of which `build` makes the same unfitted object.

    Parameters:
        part: The model or estimator.
    """
    return {"kind": part.kind, "settings": part.settings()}


def parts_within(description: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """A description itself and every part that its settings describe.

    Parameters:
        description: {"kind", "settings"} as `describe` gives it.
    """
    yield description
    for value in description["settings"].values():
        if _is_part(value):
            yield from parts_within(value)


def _is_part(value: Any) -> bool:
    return isinstance(value, dict) and value.keys() == {"kind", "settings"}


#: Of the two files; another number is refused.
FORMAT = 1

MODEL_FILE, ARRAYS_FILE = "model.json", "arrays.npz"

#: What broken content raises on its way into a model.
_BROKEN = (ValueError, TypeError, KeyError, IndexError, AttributeError, RecursionError)


#: A model taken apart: JSON, and what it learned.
Packed = tuple[dict[str, Any], Arrays]


class ModelFileError(ValueError):
    """The files of a model are not what was written."""


def pack(model: ContactModel) -> Packed:
    """A fitted model as JSON and arrays.

    Parameters:
        model: A model after `fit`.

    Raises:
        NotFittedError: Before `fit`.
    """
    return {"format": FORMAT, "model": describe(model)}, model.arrays()


def unpack(document: dict[str, Any], arrays: Arrays) -> ContactModel:
    """The model that `pack` took apart.

    Parameters:
        document: The format, and the description of the model.
        arrays: What the model has learned.

    Raises:
        ModelFileError: Where no model can be made of them.
    """
    try:
        if document["format"] != FORMAT:
            raise ModelFileError(
                f"a model of format {document['format']!r}, this software "
                f"reads {FORMAT}: update pyroshock"
            )
        model = build(document["model"])
        if not isinstance(model, ContactModel):
            raise ModelFileError(
                f"{model.kind!r} is an estimator, a part of a model; a whole one is expected"
            )
        return model.restore(arrays)
    except ModelFileError:
        raise
    except _BROKEN as error:
        raise ModelFileError(f"no model can be made of this file: {_error_line(error)}") from error


def write_model(packed: Packed, about: dict[str, Any], folder: Path) -> str:
    """Write both files of a model.

    Parameters:
        packed: The model as `pack` gives it.
        about: What is kept beside the model in `model.json`, as JSON holds it.
        folder: The folder of the files, which is made if there is none.

    Returns:
        The SHA-256 of `model.json`. The file holds that of `arrays.npz`, so that one digest vouches
        for both.

    Raises:
        ValueError: For an array that holds Python objects.
    """
    document, arrays = packed
    _refuse_objects(arrays)
    folder.mkdir(parents=True, exist_ok=True)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    content = {**document, "arrays_sha256": _digest(buffer.getvalue()), "about": about}
    text = json.dumps(content, indent=1, sort_keys=True, allow_nan=False).encode()
    (folder / ARRAYS_FILE).write_bytes(buffer.getvalue())
    (folder / MODEL_FILE).write_bytes(text)
    return _digest(text)


def read_model(folder: Path, sha256: str | None = None) -> tuple[ContactModel, dict[str, Any]]:
    """A model, and what was kept beside it.

    Parameters:
        folder: The folder of both files.
        sha256: What `write_model` returned; by default it is not known, and not checked.

    Raises:
        ModelFileError: For files that are not those written.
    """
    document, packed = read_files(folder, sha256)
    try:
        return unpack(document, _read_arrays(packed)), document["about"]
    except ModelFileError as error:
        raise ModelFileError(f"{folder}: {error}") from error
    except _BROKEN as error:
        raise ModelFileError(
            f"{folder / MODEL_FILE} is no description of a model: {_error_line(error)}"
        ) from error


def read_files(folder: Path, sha256: str | None = None) -> tuple[dict[str, Any], bytes]:
    """Both files, held against their digests; no model is made of them.

    Parameters:
        folder: The folder of the files.
        sha256: What `write_model` returned; by default it is not known, and not checked.

    Returns:
        The content of `model.json`, and the bytes of `arrays.npz`.

    Raises:
        ModelFileError: For files that cannot be read or are not those written.
    """
    try:
        text = (folder / MODEL_FILE).read_bytes()
        packed = (folder / ARRAYS_FILE).read_bytes()
    except OSError as error:
        raise ModelFileError(f"{error.filename} cannot be read: {error.strerror}") from error
    if sha256 is not None and _digest(text) != sha256:
        raise ModelFileError(f"{folder / MODEL_FILE} is not the file that was registered")
    try:
        document: dict[str, Any] = json.loads(text)
        intact = _digest(packed) == document["arrays_sha256"]
    except _BROKEN as error:
        raise ModelFileError(
            f"{folder / MODEL_FILE} is no description of a model: {_error_line(error)}"
        ) from error
    if not intact:
        raise ModelFileError(
            f"{folder / ARRAYS_FILE} is not the file that {MODEL_FILE} was written with"
        )
    return document, packed


def _read_arrays(packed: bytes) -> Arrays:
    try:
        with np.load(io.BytesIO(packed), allow_pickle=False) as file:
            return {name: file[name] for name in file.files}
    except (
        zipfile.BadZipFile,
        zlib.error,
        EOFError,
        OSError,
        NotImplementedError,
        *_BROKEN,
    ) as error:
        raise ModelFileError(
            f"{ARRAYS_FILE} holds no plain arrays: {_error_line(error)}"
        ) from error


def _refuse_objects(arrays: Arrays) -> None:
    for name, values in arrays.items():
        if values.dtype.hasobject:
            raise ValueError(f"array {name!r} holds Python objects; only plain numbers are written")


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


def _error_line(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"
