"""`db check`: is all of it there, and as it was written?"""

from __future__ import annotations

from pathlib import Path

import click

from ..common import db_option, json_option, note, opened, write_json
from ..completion import campaign_names


@click.command()
@db_option
@json_option
@click.option(
    "--campaign",
    metavar="NAME",
    help="Only this campaign's recordings, impacts and pulses.",
    shell_complete=campaign_names,
)
@click.option("--fast", is_flag=True, help="Count and compare, but read no series, pulse, dataset or model.")
@click.option(
    "--repair",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="First read damaged series again from this campaign folder.",
)
def check(db: str, json_to: str | None, campaign: str | None, fast: bool, repair: Path | None) -> None:
    """Verify hashes, references and counts of the store. Exit code 1: something is wrong, and is named.

    Every series is decoded and compared with the SHA-256 of what was recorded; every reference must lead to a row,
    every dataset give its hash, every registered model load.

    \b
    Example:
        pyroshock db check --db sqlite:///lab.db
        pyroshock db check --repair my-campaign/
    """
    with opened(db) as store:
        from ....schema.engine import describe
        from ...care.check import Wanted, findings_of
        from ...care.datasets import datasets_without_source
        from ...progress import progress_bar

        if repair is not None:
            _repair(store, repair)
        with progress_bar("Checking", "samples") as step:
            findings = list(findings_of(store, db, Wanted(campaign, fast), step))
        if json_to is not None:
            write_json({"sound": not findings, "findings": [finding.as_json() for finding in findings]}, json_to)
        else:
            for finding in findings:
                click.echo(str(finding))
        if not fast and campaign is None:
            with store.reading() as session:
                for words in datasets_without_source(session):
                    note(words)
        address = describe(store.engine)
    note(f"{address}: {len(findings)} findings" if findings else f"{address} is sound")
    if findings:
        raise click.exceptions.Exit(1)


def _repair(store: object, folder: Path) -> None:
    from ....ingest.repair import repair_series

    report = repair_series(store, folder)  # type: ignore[arg-type]
    for finding in report.mended:
        note(f"mended: {report.campaign}, {finding}")
    for finding, reason in report.left.items():
        note(f"left as it is: {report.campaign}, {finding}: {reason}")
