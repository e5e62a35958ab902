"""A dataset or a version of a model deleted: first what goes, what stays and what uses it, then it
goes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ...dataset.catalog import get_snapshot_row
from ..common.model_registry import models_extra, needed
from ..operations.train.deletion import (
    InUseError,
    unused_version,
    versions_of_dataset,
)
from ..web.dependencies import Configured, Key, Name, OpenStore
from ..web.rendering import page, part

router = APIRouter()


@router.get("/datasets/{name}/delete")
def ask_dataset(request: Request, name: Name, store: OpenStore, settings: Configured) -> Response:
    row = store.read(lambda session: get_snapshot_row(session, name))
    users = {
        f"/models/{part(version.name)}/{version.version}": version.label
        for version in versions_of_dataset(store, settings.db, name)
    }
    return _confirmation_page(
        request,
        f"dataset {row.name}",
        f"/datasets/{part(row.name)}",
        users,
        why="It cannot be deleted, because models were trained on it. Their figures could not be "
        "computed again. Delete these models first:",
        lost=[f"The dataset {row.name}: its name and the list of its pulses."],
        kept=[
            "The pulses, with their impacts and campaigns. The same dataset "
            "can be built from them again."
        ],
    )


@router.get("/models/{name}/{version}/delete")
def ask_version(request: Request, name: Name, version: Key, settings: Configured) -> Response:
    label = f"{name}@{version}"
    with models_extra():
        needed(settings.db)
    try:
        unused_version(settings.db, label)
        why = ""
    except InUseError:  # the page says so, with what to do
        why = (
            "It cannot be deleted, because it is the model in use: predictions take it. Promote "
            "another version first, here:"
        )
    return _confirmation_page(
        request,
        f"model {label}",
        f"/models/{part(name)}/{version}",
        {"/models": "Models"} if why else {},
        why=why,
        lost=[
            f"The model {label} with its files, its figures on every split, "
            f"and the trials of its search for settings.",
            "Its number: it is not given to another version.",
        ],
        kept=[
            "Predictions, diagnoses and reports that were made with it, and "
            "the decisions on its promotion."
        ],
    )


def _confirmation_page(
    request: Request, what: str, address: str, users: Mapping[str, str], **words: Any
) -> Response:
    """`users` are addresses of what uses it and their words: with one, the page has no button that
    deletes."""
    return page(request, "delete.html", what=what, address=address, users=users, **words)
