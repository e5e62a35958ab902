"""`ingest`: campaign folders into the store."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ...ingest.errors import enumerated
from .common import STDOUT, db_option, json_option, note, opened, opened_to_try, write_json
from .completion import plan_names
from .settings import settings_from, settings_options


@click.command()
@click.argument("folders", nargs=-1, type=click.Path(path_type=Path), metavar="FOLDER…")
@db_option
@json_option
@click.option(
    "--jobs",
    type=click.IntRange(1),
    default=None,
    help="Processes that read and extract. [cores, at most 4; 1 for small files]",
)
@click.option(
    "--plan",
    default=None,
    help="The plan that is worked off. [the one of the campaign's name, if any]",
    shell_complete=plan_names,
)
@click.option(
    "--free-factor",
    "free_factors",
    multiple=True,
    metavar="COLUMN",
    help="This column of runs.csv is a factor of its own, though its name resembles a known column. Repeatable.",
)
@click.option(
    "--confirm",
    "confirmed",
    multiple=True,
    metavar="RULE",
    help="Rows may break this rule of what a bench can have; the refusal names it. Repeatable.",
)
@click.option(
    "--again",
    multiple=True,
    metavar="RECORDING",
    help="Store this recording though it was discarded (`runs discard`); its path as in runs.csv. Repeatable.",
)
@click.option(
    "--velocity-target-motion",
    "target_motion",
    type=click.Choice(["none", "plate"]),
    default="none",
    show_default=True,
    help="Add the plate's motion under the force to velocities integrated from the impactor's deceleration.",
)
@click.option("--dry-run", is_flag=True, help="Say everything, store nothing: each folder beside what is stored now.")
@settings_options
def ingest(
    folders: tuple[Path, ...],
    db: str,
    json_to: str | None,
    jobs: int | None,
    plan: str | None,
    free_factors: tuple[str, ...],
    confirmed: tuple[str, ...],
    again: tuple[str, ...],
    target_motion: str,
    dry_run: bool,
    **given: Any,
) -> None:
    """Read campaign folders into the store (which is made if there is none).

    What is already stored is not stored again: ingesting twice, or after a kill, completes the campaign. A damaged
    recording is set aside with its reason, and one that was discarded stays out. Runs of a plan are marked as done;
    what does not match it is told.

    \b
    Example:
        pyroshock ingest my-campaign/ --dry-run
        pyroshock ingest my-campaign/ --db sqlite:///lab.db
        pyroshock ingest hammer-campaign/ --velocity-target-motion plate
    """
    # `--json FOLDER`: the folder is the argument, not where the JSON goes.
    if json_to not in (None, STDOUT) and Path(json_to or "").is_dir():
        folders, json_to = (Path(json_to or ""), *folders), STDOUT
    if not folders:
        raise click.UsageError("no campaign folder given; try: pyroshock ingest my-campaign/")
    reports = []
    with opened_to_try(db) if dry_run else opened(db, create=True) as store:
        from ..library.ingestion import IngestOptions, ingest_campaign
        from ..progress import progress_bar

        options = IngestOptions(
            settings_from(given), jobs, plan, free_factors, confirmed, again, target_motion, dry_run
        )
        for folder in folders:
            with progress_bar(folder.name, "recordings") as step:
                ingested = ingest_campaign(store, folder, options, step)
            reports.append(ingested.to_json())
            _tell(ingested.report, dry_run)
            if ingested.links is not None:
                _tell_links(ingested.links)
    if json_to is not None:
        write_json(reports[0] if len(reports) == 1 else reports, json_to)


#: Notes on the campaign, of which there is one.
_TOLD_WHOLE = ("added-facts", "missing-facts")


def _tell_links(links: Any) -> None:
    note(f"  plan {links.plan}: {links.linked} repetitions linked, {links.done} runs done")
    for item in links.mismatches:
        note(f"  not as planned: run {item['run']}: {item['reason']}")


def _tell(report: Any, dry_run: bool) -> None:
    from ...ingest.report import DISCARDED

    added = ", ".join(f"{count} {what}" for what, count in report.added.items() if count) or "nothing new"
    totals = f"{report.recordings} recordings, {report.impacts} impacts, {report.shots} shots"
    if dry_run:
        note(f"{report.campaign}: dry run, nothing is stored; would add {added}; the campaign would hold {totals}")
    else:
        note(f"{report.campaign}: added {added}; the campaign holds {totals}")
    if report.undeclared_factors:
        note(f"  free factors: {', '.join(report.undeclared_factors)} (not declared in [factors] of campaign.toml)")
    for item in report.set_aside:
        note(f"  set aside {item['recording']}: {item['reason']}")
    for item in report.findings:
        if item["check"] == DISCARDED:
            note(f"  {item['message']}")
    by_check: dict[tuple[str, str], list[str | None]] = {}
    for finding in (entry for entry in report.findings if entry["check"] != DISCARDED):
        if finding["check"] in _TOLD_WHOLE:
            note(f"  note: {finding['check']}: {finding['message']}")
            continue
        by_check.setdefault((finding["severity"], finding["check"]), []).append(finding["channel"])
    for (severity, check), channels in sorted(by_check.items()):
        named = sorted({channel for channel in channels if channel is not None})
        of = f" of {enumerated(named)}" if named else ""
        note(f"  {severity}: {check} ({len(channels)}){of}")
