"""A diagnosis as a job: of a campaign in the store, which keeps it."""

from __future__ import annotations

from ...schema.session import Store
from ..diagnosing import Asked, diagnosed, is_stored, keep, report_json
from .asking import signed
from .jobs import Job, Jobs, Result, Step


def diagnose_job(jobs: Jobs, store: Store, db: str, asked: Asked) -> Job:
    """Queue a diagnosis; its result is the report (`diagnosis-report.md`).

    Raises `LookupError` for a campaign that is not in the store: a path of the server's disk is nobody's to name.
    """
    if not is_stored(store, asked.target):
        raise LookupError(f"no campaign {asked.target!r} in the store; ingest it first")

    def work(step: Step) -> Result:
        from ..reports.sentences import verdict_sentence

        own = signed(store, f"serve: diagnose {asked.target}")
        verdict = diagnosed(own, db, asked, step)
        key = keep(own, verdict)
        return Result(f"/diagnoses/{key}", verdict_sentence(verdict), {"id": key, **report_json(verdict)})

    return jobs.start(f"Diagnosis of {asked.target}", work)
