"""The API of tuning: a spectrum to settings, as a job."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from ..web.dependencies import OpenStore, Running
from .request import Tuning, tune_job

router = APIRouter(tags=["twin"])


@router.post("/tune")
def tune(asked: Tuning, store: OpenStore, running: Running) -> dict[str, Any]:
    """Settings of the bench for a spectrum; answers with the job, whose result is `tune --json`."""
    return tune_job(running, store, asked).as_json()
