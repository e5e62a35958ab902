"""A campaign deleted, a recording discarded: first what stands on it, then the reason, then it
goes."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Form
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...schema.recordings import Recording
from ...schema.session import Store
from ..operations.faults import FieldError, read
from ..operations.impacts.impact import get_impact, impact_page
from ..operations.ingest.removal import standing_on
from ..operations.ingest.removed import standing_lines
from ..operations.ingest.runs import RUN_DISCARD, DiscardedRecording, RunDiscard
from ..operations.laboratory import Laboratory
from ..web.dependencies import Configured, InLaboratory, Key, Name, OpenStore, Text
from ..web.rendering import page, part
from ..web.role_needs import role_of
from .impact_lists import Ticked, ticked

router = APIRouter()
Reason = Annotated[Text, Form(max_length=4000)]


@router.get("/campaigns/{name}/delete")
def ask_campaign(request: Request, name: Name, store: OpenStore, settings: Configured) -> Response:
    return _confirmation_page(
        request, standing_on(store, settings.db, name), f"/campaigns/{part(name)}/delete"
    )


@router.get("/impacts/{impact}/discard")
def ask_recording(
    request: Request, impact: Key, store: OpenStore, settings: Configured
) -> Response:
    campaign, path = recording_of(store, impact)
    return _confirmation_page(
        request, standing_on(store, settings.db, campaign, path), f"/impacts/{impact}/discard"
    )


@router.post("/impacts/{impact}/discard", dependencies=[Depends(role_of(RUN_DISCARD))])
def discard(impact: Key, laboratory: InLaboratory, reason: Reason) -> Response:
    discarded = _discarded(laboratory, recording_of(laboratory.store, impact), reason)
    return RedirectResponse(discarded.address(), 303)


def _discarded(
    laboratory: Laboratory, recording: tuple[str, str], reason: str
) -> DiscardedRecording:
    values = {"campaign": recording[0], "recording": recording[1], "reason": reason}
    request = read(RunDiscard, values, "network")
    return RUN_DISCARD.answer(request, laboratory, lambda _done, _total, _what: None)


@router.post("/impacts/reject", dependencies=[Depends(role_of(RUN_DISCARD))])
def reject(
    laboratory: InLaboratory,
    impact: Ticked = [],  # noqa: B006
    reason: Annotated[Text, Form(max_length=4000)] = "",
) -> Response:
    """Discard the recordings of the impacts that are ticked; the reason stays with each."""
    impacts = ticked(impact)
    if not reason.strip():
        raise FieldError(
            "reason", "Say why these recordings are rejected; the reason is kept with each of them."
        )
    # all are looked up before any is gone
    for recording in dict.fromkeys([recording_of(laboratory.store, key) for key in impacts]):
        _discarded(laboratory, recording, reason)
    return RedirectResponse("/impacts", 303)


def recording_of(store: Store, impact: int) -> tuple[str, str]:
    """Campaign and path of the recording that an impact is of. Raises `LookupError` where there is
    none."""
    with store.reading() as session:
        key = get_impact(session, impact).recording_id
        if key is None:
            raise LookupError(
                f"impact {impact} came from a row without "
                f"a recording; only recordings are discarded"
            )
        return impact_page(session, impact)["campaign"], session.get_one(Recording, key).path


def _confirmation_page(request: Request, standing: dict[str, Any], address: str) -> Response:
    return page(
        request,
        "removal.html",
        campaign=standing["campaign"],
        recording=standing["recording"],
        counts=[
            {"table": table.replace("_", " "), "rows": rows}
            for table, rows in standing["counts"].items()
        ],
        lines=standing_lines(standing),
        address=address,
    )
