"""A diagnosis as a job: of a campaign in the store, which keeps it."""

from __future__ import annotations

from ...schema.session import Store
from ..diagnoses.diagnosing import is_stored
from ..jobs.kinds.diagnose import DIAGNOSE, DiagnoseArguments
from ..jobs.queue import JobView
from .jobs import Jobs


def diagnose_job(jobs: Jobs, store: Store, asked: DiagnoseArguments) -> JobView:
    """Queue a diagnosis; its result is the report (`diagnosis-report.md`).

    Raises `LookupError` for a campaign that is not in the store: a path of the server's disk is nobody's to name.
    """
    if not is_stored(store, asked.target):
        raise LookupError(f"no campaign {asked.target!r} in the store; ingest it first")
    return jobs.ask(store, DIAGNOSE, f"Diagnosis of {asked.target}", asked)
