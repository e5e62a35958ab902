"""Pulses of a whole campaign extracted again: some recordings are tried first, then all are stored
by a job."""

from __future__ import annotations

from dataclasses import dataclass, field
from statistics import median

from fastapi import APIRouter
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import Response

from ...ingest.extraction.settings import ExtractionSettings
from ...ingest.storing.reextraction import preview_impacts
from ...schema.conditions import get_campaign_id
from ...schema.impacts import Pulse
from ...schema.recordings import STORED, Recording
from ...schema.series import SeriesError
from ...schema.session import Store
from ..common.number_format import percent, signed_percent
from ..operations.faults import RequestError, read
from ..operations.form import controls
from ..operations.ingest.extract import EXTRACT, Extraction
from ..operations.ingest.request import ExtractionChoice
from ..web.dependencies import Name, OpenStore
from ..web.rendering import page

router = APIRouter()
#: Recordings that a preview reads, taken evenly from the campaign.
TRIED = 12


@dataclass(frozen=True)
class ExtractionPreview:
    """What the settings give on some recordings. `changes` of the contact times are shares of those
    in use."""

    recordings: int
    tried: int
    impacts: int
    skipped: list[dict[str, str]] = field(default_factory=list)
    changes: list[float] = field(default_factory=list)

    @property
    def sentence(self) -> str:
        """What a person decides by."""
        good = self.tried - len(self.skipped)
        text = (
            f"Of {self.recordings} recordings {self.tried} were tried: {good} "
            f"give a pulse for each of their impacts"
        )
        text += f" ({self.impacts} impacts)"
        if self.skipped:
            text += f", {len(self.skipped)} would be left as they are"
        if self.changes:
            largest = max(map(abs, self.changes))
            text += (
                f". The contact times change by {signed_percent(median(self.changes))} in the "
                f"median, and by {percent(largest)} at most"
            )
        return text.replace("-", "−") + "."


def preview_campaign(
    store: Store, campaign: str, settings: ExtractionSettings
) -> ExtractionPreview:
    """Extract some recordings, and store nothing. Raises `LookupError` for an unknown campaign."""
    with store.reading() as session:
        query = select(Recording.id, Recording.path).where(
            Recording.campaign_id == get_campaign_id(session, campaign), Recording.status == STORED
        )
        recordings = session.execute(query.order_by(Recording.id)).all()
    chosen = recordings[:: max(1, -(-len(recordings) // TRIED))]
    skipped, changes, impacts = [], [], 0
    for key, path in chosen:
        try:
            extracted = preview_impacts(store, key, settings)
        except (LookupError, SeriesError) as error:
            skipped.append({"recording": path, "reason": str(error)})
            continue
        if extracted.mismatch is not None:
            skipped.append({"recording": path, "reason": extracted.mismatch})
            continue
        impacts += len(extracted.impacts)
        with store.reading() as session:
            before = _contact_times(session, list(extracted.impacts))
        for impact, pulse in zip(extracted.impacts, extracted.pulses, strict=True):
            if before.get(impact):
                changes.append(float(pulse.contact_time_s) / before[impact] - 1)
    return ExtractionPreview(len(recordings), len(chosen), impacts, skipped, changes)


def _contact_times(session: Session, impacts: list[int]) -> dict[int, float]:
    query = select(Pulse.impact_id, Pulse.contact_time_s).where(
        Pulse.impact_id.in_(impacts), Pulse.current
    )
    return dict(iter(session.execute(query)))


@router.get("/campaigns/{name}/extract")
def ask_extraction(request: Request, name: Name, store: OpenStore) -> Response:
    """The settings, and what they give once they were tried."""
    store.read(lambda session: get_campaign_id(session, name))
    fields = ExtractionChoice.model_fields
    given = {key: text for key, text in request.query_params.items() if key in fields}
    preview, faults = None, {}
    if "preview" in request.query_params:
        try:
            extraction = read(Extraction, {**given, "campaign": name}, "network")
            preview = preview_campaign(store, name, extraction.settings())
        except RequestError as error:
            faults = {fault.field: fault.message for fault in error.faults}
    shown = controls(EXTRACT, given, names=fields)
    return page(
        request,
        "extract.html",
        status=422 if faults else 200,
        campaign=name,
        controls=shown,
        preview=preview,
        faults=faults,
    )
