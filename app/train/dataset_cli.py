"""`dataset`: pulses frozen for training, looked at, traced to their raw files, exported."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..cli.common import (
    db_option,
    json_option,
    note,
    open_command_store,
    print_table,
    spreadsheet_guard_option,
    write_json,
)
from ..cli.completion import campaign_names, dataset_names
from ..cli.listed import Listing, listing_options
from ..cli.next_step import suggest_next
from ..cli.nouns import NounGroup
from ..cli.options import split_names

if TYPE_CHECKING:
    from ...dataset.catalog import Withdrawal

_SEED = click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Set the seed of the random split.",
)


@click.group(cls=NounGroup, invoke_without_command=True)
@db_option
@listing_options
@click.pass_context
def dataset(ctx: click.Context, db: str, listing: Listing) -> None:
    """Freeze pulses for training, and see what a dataset holds. Without a command, list the
    datasets.

    \b
    Example:
        pyroshock dataset build both --from rehearsal,slow-valve
        pyroshock dataset show both --plot both.png
    """
    if ctx.invoked_subcommand is None:
        _list(db, listing)


def _list(db: str, listing: Listing) -> None:
    """List the datasets with their name, hash, pulses and campaigns.

    \b
    Example:
        pyroshock dataset list
    """
    with open_command_store(db) as store, store.reading() as session:
        from ...dataset.catalog import list_snapshots, list_withdrawals

        withdrawals = list_withdrawals(session)
        rows = [
            {**row, "withdrawn": _count_lost(withdrawals.get(row["hash"]))}
            for row in list_snapshots(session)
        ]
    listing.show(
        rows,
        "no datasets yet; freeze one: pyroshock dataset build NAME --from CAMPAIGN",
        lambda row: {
            **row,
            "hash": row["hash"][:12],
            "campaigns": ", ".join(row["campaigns"] or []),
        },
    )
    for withdrawal in withdrawals.values() if listing.json_to is None else ():
        note(withdrawal.words)


dataset.command("list")(db_option(listing_options(_list)))


def _count_lost(withdrawal: Withdrawal | None) -> int:
    return 0 if withdrawal is None else withdrawal.lost


class _Campaigns(click.Command):
    """`--from A B C`: all words after it, up to the next option, as if each had its own --from."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        out: list[str] = []
        taking = False
        for word in args:
            if word.startswith("-"):
                taking = word.split("=")[0] == "--from"
                out.append(word)
            else:
                if taking and out[-1] != "--from":
                    out.append("--from")
                out.append(word)
        return super().parse_args(ctx, out)


@dataset.command(cls=_Campaigns)
@click.argument("name")
@db_option
@json_option
@click.option(
    "--from",
    "campaigns",
    multiple=True,
    required=True,
    callback=split_names,
    metavar="CAMPAIGN…",
    help="Take the pulses of these campaigns. Repeat the option, or give a list: a,b.",
    shell_complete=campaign_names,
)
@click.option(
    "--predictors",
    metavar="SET",
    help=(
        "Choose the set of predictors: hammer, gun, or a TOML file of your "
        "own. [default: the kind of the campaigns]"
    ),
)
@click.option(
    "--quality",
    type=click.Choice(["reject", "warning", "none"]),
    default="reject",
    show_default=True,
    help="Leave out impacts with this verdict; `warning` leaves out rejected ones, too.",
)
@click.option(
    "--extraction",
    metavar="FINGERPRINT",
    help="Take the pulses of this extraction. [default: those in use]",
)
@click.option(
    "--velocity",
    type=click.Choice(["before-contact", "integrated"]),
    help="Convert impact velocities to this kind. [default: as they are stored, "
    "if all are of one kind]",
)
@click.option(
    "--split",
    default="repetitions",
    show_default=True,
    help="Count the pulses on the two sides of this split.",
)
@_SEED
def build(
    name: str,
    db: str,
    json_to: str | None,
    campaigns: tuple[str, ...],
    predictors: str | None,
    quality: str,
    extraction: str | None,
    velocity: str | None,
    split: str,
    seed: int,
) -> None:
    """Freeze the usable pulses of campaigns under NAME. The same content gives the same dataset.

    A velocity that was integrated from the deceleration of the impactor differs from the velocity
    before contact if the plate moves. A dataset has velocities of one kind; --velocity converts the
    others, by each pulse and the plate.

    \b
    Example:
        pyroshock dataset build both --from rehearsal,slow-valve --quality warning
        pyroshock dataset build before --from rehearsal --velocity before-contact
    """
    with open_command_store(db) as store:
        from ...dataset.predictors import predictors_named
        from ...dataset.selection import missing_in_campaigns, missing_words
        from ...dataset.snapshot import build_snapshot
        from ...dataset.table import check_form
        from .datasets import built_as_json

        check_form(split)
        chosen = predictors_named(predictors) if predictors else None
        built = build_snapshot(store, name, campaigns, chosen, quality, extraction, velocity)
        if not built.added:
            other_name = (
                "" if built.snapshot.name == name else f" under the name {built.snapshot.name}"
            )
            note(f"dataset {name}: this content is frozen already{other_name}; nothing was added")
        with store.reading() as session:
            facts = missing_words(
                missing_in_campaigns(session, campaigns, built.snapshot.predictors)
            )
        summary = built_as_json(built, _split_or_note(built.snapshot.table, split, seed))
        _tell_built(summary, len(built.snapshot.definition["extractions"]))
        stated = built.snapshot.definition.get("velocity") or {}
        if stated.get("converted"):
            note(
                f"  {stated['converted']} impact velocities were converted "
                f"({stated['kind']}), with a standard "
                f"uncertainty of {stated['relative_u']:.0%} in the median"
            )
        if facts:
            note(f"  {facts}")
    if json_to is not None:
        write_json(summary, json_to)
    suggest_next("train", built.snapshot.name)


def _split_or_note(table: Any, text: str, seed: int) -> Any:
    """The split; a dataset that cannot be split so is a dataset all the same."""
    from ...dataset.table import split_of

    try:
        return split_of(table, text, seed)
    except (ValueError, LookupError) as error:
        note(str(error))
        return None


def _tell_built(dataset: dict[str, Any], extractions: int) -> None:
    note(f"dataset {dataset['name']}: {dataset['pulses']} pulses, hash {dataset['hash'][:12]}")
    note(f"  {dataset['train']} to learn from, {dataset['test']} held out")
    for row in dataset["left_out"]:
        note(f"  left out: {row['impacts']} ({row['reason']})")
    if extractions > 1:
        note(
            "  the pulses are of several extractions; one for all: pyroshock "
            "extract CAMPAIGN, or --extraction"
        )


@dataset.command()
@click.argument("name", shell_complete=dataset_names)
@db_option
@json_option
@_SEED
@click.option(
    "--plot",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Draw correlations and values into FILE.png.",
)
def show(name: str, db: str, json_to: str | None, seed: int, plot: Path | None) -> None:
    """Show a dataset, given by name or hash: its sources, its splits, and the ranges and
    correlations of its predictors.

    \b
    Example:
        pyroshock dataset show rehearsal-pulses --plot pulses.png
    """
    with open_command_store(db) as store:
        from ...dataset.snapshot import read_snapshot
        from .datasets import snapshot_as_json

        snapshot = read_snapshot(store, name)
        if plot is not None:
            from ..figures.matplotlib_renderer import write_figure
            from .dataset_figures import dataset_figure

            write_figure(dataset_figure(snapshot.table), plot)
            note(f"written: {plot}")
        summary = snapshot_as_json(snapshot, seed)
    if json_to is not None:
        write_json(summary, json_to)
    else:
        _show(snapshot, summary)


def _show(snapshot: Any, dataset: dict[str, Any]) -> None:
    from .datasets import correlation_rows, range_rows

    click.echo(
        f"{dataset['name']}: {dataset['pulses']} pulses of {', '.join(dataset['campaigns'])}, "
        f"hash {dataset['hash'][:12]}"
    )
    click.echo(
        f"{dataset['configurations']} configurations; velocity aside, "
        f"predictors tell {dataset['treatments']} apart"
    )
    click.echo(
        f"quality rule {dataset['quality']}; extractions "
        f"{', '.join(key[:12] for key in dataset['extractions'])}"
    )
    print_table(dataset["left_out"], "nothing was left out")
    click.echo()
    print_table(dataset["splits"], "too few pulses for any split")
    click.echo()
    print_table(range_rows(snapshot), "no predictors")
    click.echo()
    print_table(correlation_rows(snapshot), "no predictors")


@dataset.command()
@click.argument("name", shell_complete=dataset_names)
@click.argument("key", required=False)
@db_option
@json_option
def trace(name: str, key: str | None, db: str, json_to: str | None) -> None:
    """Tell from which raw file a pulse of a dataset comes. KEY is the key of the pulse, or its
    beginning; without KEY, all files are listed.

    \b
    Example:
        pyroshock dataset trace rehearsal-pulses
    """
    with open_command_store(db) as store, store.reading() as session:
        from ...dataset.snapshot import raw_files, read_snapshot
        from ...dataset.snapshot import trace as trace_pulse

        snapshot = read_snapshot(session, name)
        origin = (
            raw_files(session, snapshot)
            if key is None
            else asdict(trace_pulse(session, snapshot, key))
        )
    if json_to is not None:
        write_json(origin, json_to)
    elif isinstance(origin, list):
        print_table(origin, "no pulses")
    else:
        print_table(
            ({"of": name, "value": str(value)} for name, value in origin.items()), "nothing"
        )


@dataset.command()
@click.argument("name", shell_complete=dataset_names)
@db_option
@click.option(
    "--out",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write to FILE.csv or FILE.parquet.",
)
@spreadsheet_guard_option
def export(name: str, db: str, out: Path) -> None:
    """Write a dataset to a file, with a row per pulse: its key, predictors, figures and points of
    force.

    \b
    Example:
        pyroshock dataset export rehearsal-pulses --out pulses.parquet
    """
    with open_command_store(db) as store:
        from ...dataset.snapshot import read_snapshot
        from .datasets import export_snapshot

        rows = export_snapshot(read_snapshot(store, name), out)
    note(f"{rows} rows written: {out}")
