"""`extract`: pulses cut anew from the stored series."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from .common import db_option, json_option, note, opened, write_json
from .completion import campaign_names
from .settings import settings_from, settings_options
from .worker_options import crew_options

if TYPE_CHECKING:
    from ...parallel.executor import Crew


@click.command()
@click.argument("campaign", shell_complete=campaign_names)
@crew_options("Processes that cut at once.")
@db_option
@json_option
@settings_options
def extract(campaign: str, crew: Crew, db: str, json_to: str | None, **given: Any) -> None:
    """Cut the pulses of CAMPAIGN anew, from the stored series, with other settings.

    The new version is in use from then on; the old ones stay (`pyroshock show` lists them), and the same
    settings again put the old version back in use.

    \b
    Example:
        pyroshock extract spring --segmentation mask --threshold 0.01
    """
    with opened(db) as store:
        from ...ingest.reextraction import reextract
        from ..progress import progress_bar

        settings = settings_from(given)
        with progress_bar(campaign, "recordings") as step:
            report = reextract(store, campaign, settings, crew=crew, progress=step)
    note(f"{campaign}: {report.added} pulses cut, {report.reused} earlier ones put back in use")
    for item in report.skipped:
        note(f"  left as it was: {item['recording']}: {item['reason']}")
    if json_to is not None:
        write_json(report.as_json(), json_to)
