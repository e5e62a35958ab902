"""The first page: what was recorded lately, what needs attention, what runs; of an empty store, the
first steps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fastapi import APIRouter
from starlette.requests import Request
from starlette.responses import Response

from ..common.errors import is_for_the_user
from ..common.model_registry import models_extra, registry_at
from ..web.dependencies import Configured, OpenStore
from ..web.rendering import page
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
    if registry_fault:
        sentence = f"The registry of models cannot be read: {registry_fault}"
        attention.insert(0, AttentionItem(sentence, "/models", "See the models", True))
    return page(request, "home.html", campaigns=campaigns, attention=attention, running=running)


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
