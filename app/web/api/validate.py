"""The twin beside measured shots that it had not seen."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from ..dependencies import OpenStore, Running
from ..validating import ValidationQuestion, validate_job

router = APIRouter(tags=["twin"])


@router.post("/validate")
def validate(question: ValidationQuestion, store: OpenStore, running: Running) -> dict[str, Any]:
    """Validate the twin on a campaign; answers with the job, whose result is `pyroshock validate --json`."""
    return validate_job(running, store, question).as_json()
