"""`plan`: designs made, kept and worked off, and the experiment that a diagnosis names. `simulate`:
a plan played on the virtual bench, into a campaign folder."""

from __future__ import annotations

from pathlib import Path

import click

from ..cli.common import (
    db_option,
    jobs_option,
    json_option,
    note,
    open_command_store,
    print_table,
    spreadsheet_guard_option,
    write_json,
)
from ..cli.completion import campaign_names, effect_ids, plan_names
from ..cli.listed import Listing, listing_options
from ..cli.next_step import suggest_next
from ..cli.options import split_names
from ..common.progress import progress_bar
from .designs_cli import DesignCommands, augment, tell_plan


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
        from ..common.plan_tables import settings_in_si
        from ..diagnose.diagnosing import keep, last_report, report_json, run_diagnosis
        from ..diagnose.discriminating_plan import no_setting, plan_name, store_experiment
        from ..diagnose.request import DiagnosisRequest
        from ..diagnose.wording import spell_sets

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
    tell_plan(stored, rows, json_to, out)
    suggest_next("plan", "sheet", stored.name, "--out", f"{stored.name}.html")


@click.group(cls=DesignCommands, invoke_without_command=True)
@db_option
@listing_options
@click.pass_context
def plan(ctx: click.Context, db: str, listing: Listing) -> None:
    """Plan a campaign: make a design, store it, and see what is still to do. Without a command,
    list the plans.

    \b
    Example:
        pyroshock plan lhs autumn --runs 12
        pyroshock plan sheet autumn --out autumn.html
        pyroshock plan status autumn
    """
    if ctx.invoked_subcommand is None:
        _list(db, listing)


def _list(db: str, listing: Listing) -> None:
    """List the plans with their counts of runs.

    \b
    Example:
        pyroshock plan list
    """
    with open_command_store(db) as store, store.reading() as session:
        from ...doe.plans import list_plans

        rows = list_plans(session)
    listing.show(rows, "no plans; make one: pyroshock plan lhs NAME --runs 105")


plan.command("list")(db_option(listing_options(_list)))


@plan.command()
@click.argument("name", shell_complete=plan_names)
@click.argument("run", type=int)
@click.option("--reason", required=True, help="Say why. The plan keeps the reason with the run.")
@db_option
def discard(name: str, run: int, reason: str, db: str) -> None:
    """Take a run out of a plan, for example because a part broke or its records are bad.

    \b
    Example:
        pyroshock plan discard rehearsal 17 --reason "tip broke"
    """
    from ...doe.plans import discard_run

    with open_command_store(db) as store:
        discard_run(store, name, run, reason)
    note(f"plan {name}: run {run} discarded")
    suggest_next("plan", "augment", name)


@plan.command()
@click.argument("name", shell_complete=plan_names)
@click.option(
    "--against",
    default=None,
    metavar="OTHER",
    help="Compare with another plan, or with a table (CSV) of the same factors.",
    shell_complete=plan_names,
)
@click.option(
    "--plot",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Draw the quality of the plan into FILE.png.",
)
@click.option(
    "--effect",
    type=click.FloatRange(0, min_open=True),
    default=2.0,
    show_default=True,
    help="Show the power for an effect of this many standard deviations of a run.",
)
@db_option
@json_option
def quality(
    name: str, against: str | None, plot: Path | None, effect: float, db: str, json_to: str | None
) -> None:
    """Say whether a plan is good, with the reasons and their cures, and measure it: balance of
    levels, pairs and triples, space filling, power, changeovers, and confounding with other effects
    and with time.

    The figures stand between the best that any plan of so many runs can have, where a bound is
    known, and the median of plans drawn at random. The power is the chance that the effect of a
    factor is seen, in a model of all main effects at a significance of 5 %.

    \b
    Example:
        pyroshock plan quality rehearsal --against slow-valve --plot quality.png
    """
    from .quality import designs_of, figures_as_json, judged_designs, tables, verdict_lines

    with open_command_store(db) as store:
        space, designs = designs_of(store, name, against)
        judged = judged_designs(space, designs, effect)
        if plot is not None:
            from ..figures.matplotlib_renderer import write_figure
            from .figures import quality_figure

            write_figure(quality_figure(space, designs), plot)
            note(f"plot: {plot}")
    if json_to is not None:
        write_json(figures_as_json(space, judged), json_to)
        return
    for line in verdict_lines(judged):
        click.echo(line)
    for title, rows in tables(space, judged):
        click.echo(f"\n{title}" if title else "")
        print_table(rows, "nothing to show")


@plan.command()
@click.argument("name", shell_complete=plan_names)
@db_option
@json_option
def status(name: str, db: str, json_to: str | None) -> None:
    """Show which runs of a plan are done, still to do, or discarded.

    \b
    Example:
        pyroshock plan status rehearsal
    """
    from ...doe.plans import read_plan
    from ..common.plan_tables import plan_as_json, run_counts, settings_in_si

    with open_command_store(db) as store, store.reading() as session:
        stored = read_plan(session, name)
    if json_to is not None:
        write_json(plan_as_json(stored), json_to)
        return
    counts = run_counts(stored)
    repeats = f", {counts['repeat']} to repeat" if counts["repeat"] else ""
    open_runs = f"{counts['planned']} to do ({counts['begun']} begun{repeats})"
    click.echo(f"{name}: {counts['done']} done, {open_runs}, {counts['discarded']} discarded")
    print_table(
        (
            {
                "run": run.run,
                "state": run.state,
                "recorded": f"{len(run.accepted)}/{run.repetitions}",
            }
            | settings_in_si(run.row)
            | ({"reason": run.reason} if run.reason else {})
            for run in stored.runs
        ),
        "no runs",
    )


@plan.command()
@click.argument("name", shell_complete=plan_names)
@click.option(
    "--out",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    metavar="FILE.html|.csv|.xlsx",
    help="Write to this file; its ending chooses the format.",
)
@spreadsheet_guard_option
@db_option
def sheet(name: str, out: Path, db: str) -> None:
    """Write the run sheet for the bench: the runs in their order, with a box to tick for each.

    \b
    Example:
        pyroshock plan sheet rehearsal --out rehearsal.html
    """
    from ...doe.plans import read_plan
    from ...doe.sheet import write_sheet

    with open_command_store(db) as store, store.reading() as session:
        stored = read_plan(session, name)
        write_sheet(stored, out)
    note(f"written: {out}")
    suggest_next("campaigns", "init", name, "--kind", stored.space.kind, "--plan", name)


for command in (augment, discriminate):
    plan.add_command(command)


@click.command()
@click.argument("plan", shell_complete=plan_names)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    required=True,
    metavar="FOLDER",
    help="Write the campaign to this new folder.",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Set the seed: the same seed gives the same files.",
)
@click.option(
    "--effect",
    "effects",
    multiple=True,
    callback=split_names,
    metavar="NAME=STRENGTH",
    help=(
        "Set the strength of an effect: 0 removes it, 1 is the strength of a "
        "realistic bench. Repeat the option, or "
        "give a list: a=2,b=3."
    ),
    shell_complete=effect_ids,
)
@click.option(
    "--echoes", is_flag=True, help="Let reflections from the edges of the plate act on the contact."
)
@click.option("--name", default=None, help="Name the campaign. [default: the name of the plan]")
@click.option(
    "--repetitions",
    type=click.IntRange(1),
    default=None,
    help="Set the number of repetitions of each run. [default: that of the plan]",
)
@click.option(
    "--trigger",
    metavar="5%|none",
    default=None,
    help="Set the share of the tank pressure whose loss triggers the record of a "
    "gun. [default: 5%]",
)
@click.option(
    "--pre-trigger",
    metavar="300ms",
    default=None,
    help="Set the time that is recorded before the trigger. [default: 300ms]",
)
@jobs_option("Set the number of processes.")
@db_option
@json_option
def simulate(
    plan: str,
    out: Path,
    seed: int,
    effects: tuple[str, ...],
    echoes: bool,
    name: str | None,
    repetitions: int | None,
    trigger: str | None,
    pre_trigger: str | None,
    jobs: int | None,
    db: str,
    json_to: str | None,
) -> None:
    """Fire PLAN on the virtual bench, which writes recordings as a real bench does, to try
    everything on.

    The settings and the true values are written to FOLDER.sealed.json, for the person who scores a
    diagnosis afterwards.

    \b
    Example:
        pyroshock simulate slow-valve --out autumn/ --name autumn --effect gun.blow_by=3
        pyroshock ingest autumn/
    """
    progress = progress_bar(f"Simulating plan {plan} (the plate is solved first)", "recordings")
    with open_command_store(db) as store:
        from ...doe.plans import read_plan
        from .rehearsal import simulate_plan

        with store.reading() as session:
            stored = read_plan(session, plan)
        with progress as step:
            made = simulate_plan(
                stored,
                out,
                seed=seed,
                effects=_strengths(effects),
                echoes=echoes,
                name=name,
                repetitions=repetitions,
                trigger=trigger,
                pre_trigger=pre_trigger,
                jobs=jobs,
                progress=step,
            )
    what = "shots" if stored.space.kind == "gun" else "hits"
    note(
        f"{made.folder}: {made.recordings} recordings with {made.hits} "
        f"{what}; settings and true values: {made.seal}"
    )
    if json_to is not None:
        write_json(
            {
                "folder": str(made.folder),
                "recordings": made.recordings,
                "hits": made.hits,
                "seal": str(made.seal),
            },
            json_to,
        )
    suggest_next("ingest", str(made.folder))


def _strengths(texts: tuple[str, ...]) -> dict[str, float]:
    """Effect -> strength, of NAME=STRENGTH; 1 where none is given. Raises `ValueError`."""
    strengths = {}
    for text in texts:
        name, sign, strength = text.partition("=")
        try:
            strengths[name.strip()] = float(strength) if sign else 1.0
        except ValueError as error:
            raise ValueError(
                f"--effect {text!r}; expected NAME=STRENGTH, such as gun.blow_by=2"
            ) from error
    return strengths
