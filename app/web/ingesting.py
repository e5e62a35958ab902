"""A campaign folder into the store, as a job of this machine."""

from __future__ import annotations

from pathlib import Path

from ...ingest.settings import ExtractionSettings
from ...schema.session import Store
from ..jobs.kinds.ingest import INGEST, IngestArguments
from ..jobs.queue import JobView, this_host
from .jobs import Jobs


def ingest_job(
    jobs: Jobs,
    store: Store,
    folder: Path,
    settings: ExtractionSettings,
    plan: str | None = None,
    scratch: Path | None = None,
) -> JobView:
    """Queue the ingest of `folder`; `scratch` is removed however it ends. The result is `command-line.md`'s JSON."""
    arguments = IngestArguments(str(folder), settings.as_json(), plan, None if scratch is None else str(scratch))
    return jobs.ask(store, INGEST, f"Ingest of {folder.name}", arguments, host=this_host())
