"""A job in words: what its kind is called, how long it has taken and will take, what its result is,
what to do when it failed."""

from __future__ import annotations

from datetime import UTC, datetime
from urllib.parse import unquote

from ...schema.jobs import FAILED, RUNNING, STOPPED, WAITING
from ..common.progress import LEAST_SHARE
from ..jobs.queue import JobView

#: Kind of job -> what it is called.
KIND_WORDS = {
    "ingest": "ingest",
    "check": "check of a folder",
    "describe": "reading of recordings for a form",
    "archive": "archive of a campaign",
    "restore": "return of a campaign",
    "extract": "extraction of pulses",
    "plan": "plan",
    "train": "training",
    "tune": "search for settings",
    "diagnose": "diagnosis",
    "validate": "validation",
}
#: Start of the address of a result -> what its button opens; the rest of the address follows where
#: there is a name.
_RESULTS = {
    "/campaigns/": "Open campaign",
    "/plans/": "Open plan",
    "/diagnoses/": "Open diagnosis",
    "/validations/": "Open the validation",
    "/tune/": "Open the proposed settings",
    "/models": "Open the models",
    "/ingest/checks/": "Open the check",
    "/ingest/forms/": "Open the form",
    "/deleted": "Open the deleted and archived campaigns",
}
_UNNAMED = ("/validations/", "/tune/", "/models", "/ingest/checks/", "/ingest/forms/", "/deleted")
_FAULT = "an error of pyroshock itself"


def kind_words(kind: str) -> str:
    """What a kind of job is called; its own name for one of another version."""
    return KIND_WORDS.get(kind, kind)


def result_words(address: str | None) -> str:
    """What the button of a result opens: `Open campaign spring`."""
    for start, words in _RESULTS.items():
        if address is not None and address.startswith(start):
            return words if start in _UNNAMED else f"{words} {unquote(address.removeprefix(start))}"
    return "Open the result"


def duration_words(seconds: float) -> str:
    """`3 min 20 s`, `2 h 5 min`, `0.4 s`."""
    if seconds < 10:
        return f"{max(seconds, 0.0):.1f} s"
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def elapsed_s(job: JobView, now: datetime | None = None) -> float | None:
    """Seconds from the start of a job to its end, or to `now`; None for one that has not
    started."""
    if job.started_at is None:
        return None
    return ((job.ended_at or now or datetime.now(UTC)) - job.started_at).total_seconds()


def time_words(job: JobView, now: datetime | None = None) -> str:
    """How long a job has taken and, once a tenth of it is done, about how long it will still
    take."""
    elapsed = elapsed_s(job, now)
    if elapsed is None:
        return "It has not started yet." if job.state == WAITING else "It did not start."
    if job.state != RUNNING:
        return f"It took {duration_words(elapsed)}."
    if not LEAST_SHARE * job.total <= job.done <= job.total or not job.done:
        return f"It has run for {duration_words(elapsed)}."
    remaining = elapsed * (job.total - job.done) / job.done
    return (
        f"It has run for {duration_words(elapsed)}; about "
        f"{duration_words(max(remaining, 1.0))} remain."
    )


def next_step_words(job: JobView, repeatable: bool) -> str:
    """What to do about a job that waits, was stopped or failed; "" for the others."""
    if job.state == WAITING:
        return (
            "It starts when the jobs before it have ended. You can leave this "
            "page; the job goes on."
        )
    if job.state == RUNNING:
        return "You can leave this page; the job goes on."
    if job.state == STOPPED:
        return "It was stopped. What it had stored until then is whole."
    if job.state != FAILED:
        return ""
    if _FAULT in (job.error or ""):
        return (
            "Nothing of what is stored is lost. Try again; if it fails again, send this message to "
            "whoever operates the server."
        )
    if not repeatable:
        return "Correct what the message names, and send the files or the form again."
    return (
        "Correct what the message names. Then try again with the same values, or "
        "change the values first."
    )
