"""The nouns `plan` and `plans`: designs made, judged, kept and worked off."""

from __future__ import annotations

from pathlib import Path

import click

from ...common.progress import progress_bar
from ..command_line.common import (
    db_option,
    errors_as_one_line,
    json_option,
    note,
    open_command_store,
    print_table,
    spreadsheet_guard_option,
    write_json,
)
from ..command_line.completion import campaign_names
from ..command_line.next_step import suggest_next
from ..command_line.operation_group import OperationGroup


@click.command()
@click.argument("campaign", shell_complete=campaign_names)
@click.option("--name", default=None, help="Name the plan. [default: CAMPAIGN-discriminate]")
@click.option("--anew", is_flag=True, help="Diagnose again, although the store has a diagnosis.")
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Set the seed of a new diagnosis.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Write the table of runs to FILE as CSV.",
)
@spreadsheet_guard_option
@db_option
@json_option
def discriminate(
    campaign: str,
    name: str | None,
    anew: bool,
    seed: int,
    out: Path | None,
    db: str,
    json_to: str | None,
) -> None:
    """Plan the runs that tell apart the causes which the last diagnosis of CAMPAIGN could not tell
    apart.

    \b
    Example:
        pyroshock plan discriminate slow-valve
        pyroshock plan sheet slow-valve-discriminate --out runs.html
    """
    progress = progress_bar(f"Planning the runs that tell the causes in {campaign} apart", "steps")
    with open_command_store(db) as store:
        from ...common.plan_tables import plan_as_json, settings_in_si, write_table
        from ...operations.diagnose.diagnosing import keep, last_report, report_json, run_diagnosis
        from ...operations.diagnose.discriminating_plan import (
            no_setting,
            plan_name,
            store_experiment,
        )
        from ...operations.diagnose.request import DiagnosisRequest
        from ...operations.diagnose.wording import spell_sets

        with store.reading() as session:
            report = None if anew else last_report(session, campaign)
        if report is None:
            with progress as step:
                verdict = run_diagnosis(store, db, DiagnosisRequest(campaign, seed=seed), step)
            keep(store, verdict)
            report = report_json(verdict)
        if not report["next_runs"]:
            note(no_setting(campaign))
            raise click.exceptions.Exit(1)
        stored, left_out = store_experiment(
            store, campaign, report["next_runs"], name or plan_name(campaign)
        )
    for words in (*(run["why"] for run in report["next_runs"]), *left_out):
        note(spell_sets(words))
    note(f"plan {stored.name}: {len(stored.runs)} runs")
    rows = (
        {"run": run.run, **settings_in_si(run.row), "repetitions": run.repetitions}
        for run in stored.runs
    )
    if out is not None:
        with errors_as_one_line():
            write_table(stored, out)
        note(f"written: {out}")
    if json_to is not None:
        write_json(plan_as_json(stored), json_to)
    elif out is None:
        print_table(rows, "no runs")
    suggest_next("plan", "sheet", stored.name, "--out", f"{stored.name}.html")


plan = OperationGroup(
    "plan",
    """Plan a campaign: make a design, store it, and see what is still to do. Without a command,
    list the plans.

    \b
    Example:
        pyroshock plan lhs autumn --runs 12
        pyroshock plan sheet autumn --out autumn.html
        pyroshock plan status autumn
    """,
    {"discriminate": discriminate},
)
plans = OperationGroup(
    "plans",
    """List the plans; show or delete one. Without a command, list them. `pyroshock plan` makes new
    plans.

    \b
    Example:
        pyroshock plans
        pyroshock plans show rehearsal
    """,
)
