"""A diagnosis as a job: of a campaign in the store, which keeps it."""

from __future__ import annotations

from ...schema.session import Store
from ..diagnoses.diagnosing import is_stored
from ..jobs.kinds.diagnose import DIAGNOSE, DiagnoseArguments
from ..jobs.queue import JobView
from .jobs import Jobs


def diagnose_job(jobs: Jobs, store: Store, asked: DiagnoseArguments) -> JobView:
    """Queue a diagnosis; its result is the report (`diagnosis-report.md`).

    Raises `LookupError` for a campaign that is not in the store, for a path of the server's disk is nobody's to name,
    and for an effect that the catalogue does not have.
    """
    from ..diagnoses.restriction import check_effects

    if not is_stored(store, asked.target):
        raise LookupError(f"no campaign {asked.target!r} in the store; ingest it first")
    check_effects(asked.with_effects, asked.without_effects)
    return jobs.ask(store, DIAGNOSE, _title(asked), asked)


def _title(asked: DiagnoseArguments) -> str:
    parts = [f"Diagnosis of {asked.target}"]
    parts += [f"with {', '.join(asked.with_effects)}"] if asked.with_effects else []
    parts += [f"without {', '.join(asked.without_effects)}"] if asked.without_effects else []
    return " ".join(parts)
