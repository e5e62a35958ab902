"""`plan discriminate`: the experiment that a diagnosis names, written into the store."""

from __future__ import annotations

from pathlib import Path

import click

from .common import db_option, json_option, note, opened
from .completion import campaign_names
from .plan_output import tell_plan


@click.command()
@click.argument("campaign", shell_complete=campaign_names)
@click.option("--name", default=None, help="Of the plan. [CAMPAIGN-discriminate]")
@click.option("--anew", is_flag=True, help="Diagnose once more, though the store has a diagnosis.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of a new diagnosis.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Write the table as CSV.")
@db_option
@json_option
def discriminate(
    campaign: str, name: str | None, anew: bool, seed: int, out: Path | None, db: str, json_to: str | None
) -> None:
    """Plan the runs that tell apart what the last diagnosis of CAMPAIGN could not.

    \b
    Example:
        pyroshock plan discriminate spring
        pyroshock plan sheet spring-discriminate --out spring.html
    """
    with opened(db) as store:
        from ..diagnoses.diagnosing import DiagnosisRequest, diagnosed, keep, last_report, report_json
        from ..diagnoses.discriminating_plan import no_setting, store_experiment
        from ..progress import progress_bar

        with store.reading() as session:
            report = None if anew else last_report(session, campaign)
        if report is None:
            with progress_bar("diagnose", "steps") as step:
                verdict = diagnosed(store, db, DiagnosisRequest(campaign, seed=seed), step)
            keep(store, verdict)
            report = report_json(verdict)
        if not report["next_runs"]:
            note(no_setting(campaign))
            raise click.exceptions.Exit(1)
        stored, left_out = store_experiment(store, campaign, report["next_runs"], name or f"{campaign}-discriminate")
    for words in (*(run["why"] for run in report["next_runs"]), *left_out):
        note(words)
    note(f"plan {stored.name}: {len(stored.runs)} runs; pyroshock plan sheet {stored.name} --out {stored.name}.html")
    rows = ({"run": run.run, **run.row, "repetitions": run.repetitions} for run in stored.runs)
    tell_plan(stored, rows, json_to, out)
