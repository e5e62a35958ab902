"""The first page: pictures of the laboratory, which it chooses itself; what needs attention, what
runs, what was recorded lately; of an empty store, the first steps."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fastapi import APIRouter
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import Response

from ..common.errors import is_for_the_user
from ..common.model_registry import models_extra, registry_at
from ..figures.figure import Plot
from ..operations.explore.explore import EXPLORE
from ..operations.explore.request import Exploration
from ..operations.explore.views import view_address
from ..operations.home.pictures import MOST, PICTURES, VIEW, list_choices, list_chosen
from ..operations.laboratory import Laboratory
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
        chosen, choices = list_chosen(session), list_choices(session)
        pictures = _pictures(session, Laboratory(store, settings.db), chosen, versions)
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
        chosen=chosen,
        choices=choices,
        most=MOST,
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


#: Usual picture -> the page that says more, its name, and what is said where nothing is to draw.
_USUAL = {
    "recordings-by-day": ("/campaigns", "All campaigns", "No campaign has recordings yet."),
    "models-in-use": (
        "/models",
        "All models",
        "No model is in use: predictions rest on the contact law.",
    ),
    "errors-by-campaign": ("/diagnoses", "All diagnoses", "No campaign was diagnosed yet."),
    "runs-by-plan": ("/plans", "All plans", "There is no plan yet."),
}


def _pictures(
    session: Session, laboratory: Laboratory, chosen: Sequence[str], versions: Sequence[Version]
) -> list[HomePicture]:
    """The chosen pictures in their order."""
    plots: dict[str, Callable[[], Plot | None]] = {
        "recordings-by-day": lambda: recordings_plot(session),
        "models-in-use": lambda: model_plot(versions),
        "errors-by-campaign": lambda: gaps_plot(session),
        "runs-by-plan": lambda: plans_plot(session),
    }
    return [
        HomePicture(picture, plots[picture](), PICTURES[picture], *_USUAL[picture])
        if picture in plots
        else _view_picture(laboratory, picture.removeprefix(VIEW))
        for picture in chosen
    ]


def _view_picture(laboratory: Laboratory, name: str) -> HomePicture:
    """A saved view, whose rows may be gone since it was saved."""
    plot, nothing = None, "The view has no rows to draw."
    try:
        figure = EXPLORE.answer(Exploration(view=name), laboratory, lambda *_: None).figure()
    except (LookupError, ValueError) as error:
        # its campaign was deleted, or another version stored it: the page says so in its place
        nothing = f"The view cannot be drawn: {error}"
    else:
        plot = figure if isinstance(figure, Plot) else None
        if figure is not None and plot is None:
            nothing = "The view has several charts, which its page shows."
    address = view_address(name)
    key = hashlib.sha256(name.encode()).hexdigest()[:12]
    return HomePicture(f"view-{key}", plot, f"View {name}", address, f"Open {name}", nothing)


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
