"""The first page: four pictures of the laboratory, what needs attention, what runs, what was
recorded lately; of an empty store, the first steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fastapi import APIRouter
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import Response

from ..common.errors import is_for_the_user
from ..common.model_registry import models_extra, registry_at
from ..figures.figure import Plot
from ..web.dependencies import Configured, OpenStore
from ..web.rendering import page
from .home_figures import gaps_plot, model_plot, plans_plot, recordings_plot
from .overview import AttentionItem, list_attention, list_recent_campaigns, list_running

if TYPE_CHECKING:
    from ...training.registry.records import Version

router = APIRouter()


@router.get("/")
def home(request: Request, store: OpenStore, settings: Configured) -> Response:
    versions, registry_fault = _versions(settings.db)
    with store.reading() as session:
        campaigns = list_recent_campaigns(session)
        attention = list_attention(session, versions)
        running = list_running(session)
        pictures = _pictures(session, versions)
    if registry_fault:
        sentence = f"The registry of models cannot be read: {registry_fault}"
        attention.insert(0, AttentionItem(sentence, "/models", "See the models", True))
    return page(
        request,
        "home.html",
        campaigns=campaigns,
        attention=attention,
        running=running,
        pictures=pictures,
    )


@dataclass(frozen=True)
class HomePicture:
    """A picture of the first page: the page that says more, and what is said where there is
    nothing to draw."""

    id: str
    plot: Plot | None
    label: str
    address: str
    action: str
    nothing: str


def _pictures(session: Session, versions: Sequence[Version]) -> list[HomePicture]:
    return [
        HomePicture(
            "recordings-by-day",
            recordings_plot(session),
            "Recordings of the newest days, by the worst finding of the quality checks",
            "/campaigns",
            "All campaigns",
            "No campaign has recordings yet.",
        ),
        HomePicture(
            "models-in-use",
            model_plot(versions),
            "Force error of the model in use and of its versions on the same pulses, with 90 % "
            "intervals",
            "/models",
            "All models",
            "No model is in use: predictions rest on the contact law.",
        ),
        HomePicture(
            "errors-by-campaign",
            gaps_plot(session),
            "Error of the twin on each campaign, by its newest diagnosis",
            "/diagnoses",
            "All diagnoses",
            "No campaign was diagnosed yet.",
        ),
        HomePicture(
            "runs-by-plan",
            plans_plot(session),
            "Runs of each plan, unfinished plans first",
            "/plans",
            "All plans",
            "There is no plan yet.",
        ),
    ]


def _versions(db: str) -> tuple[list[Version], str]:
    """The registered models; and why they cannot be read, which must not keep the first page from
    being shown."""
    try:
        with models_extra():
            registry = registry_at(db)
            return ([] if registry is None else list(registry.versions())), ""
    except Exception as error:
        # MLflow and its store raise many kinds; what is no matter of the user is raised again
        if not is_for_the_user(error):
            raise
        return [], str(error)
