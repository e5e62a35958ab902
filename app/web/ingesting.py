"""A campaign folder into the store, as a job."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ...ingest.load import ingest_folder
from ...ingest.plan_link import link_to_plan
from ...ingest.settings import ExtractionSettings
from ...schema.session import Store
from .asking import signed
from .jobs import Job, Jobs, Result, Step
from .rendering import part


def ingest_job(
    jobs: Jobs,
    store: Store,
    folder: Path,
    settings: ExtractionSettings,
    plan: str | None = None,
    after: Callable[[], None] = lambda: None,
) -> Job:
    """Queue the ingest of `folder`; `after` is called however it ends. The result is `command-line.md`'s JSON."""

    def work(step: Step) -> Result:
        try:
            own = signed(store, f"serve: ingest {folder.name}")
            report = ingest_folder(own, folder, settings, progress=step)
            links = link_to_plan(own, report.campaign, plan)
            data = report.as_json()
            if links is not None:
                data["findings"] = [*report.findings, *links.as_findings()]
            added = ", ".join(f"{n} {what}" for what, n in report.added.items() if n) or "nothing new"
            aside = f"; {len(report.set_aside)} recordings set aside" if report.set_aside else ""
            linked = f"; plan {links.plan}: {links.done} runs done" if links is not None else ""
            words = f"{report.campaign}: added {added}{aside}{linked}"
            return Result(f"/campaigns/{part(report.campaign)}", words, data)
        finally:
            after()

    return jobs.start(f"Ingest of {folder.name}", work)
