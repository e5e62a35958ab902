"""`compare`: which model is better."""

from __future__ import annotations

from pathlib import Path

import click

from .common import db_option, json_option, note, opened, print_table, write_json
from .completion import dataset_names, model_versions


@click.command()
@click.argument("names", nargs=-1, metavar="[MODEL[@VERSION]]...", shell_complete=model_versions)
@click.option(
    "--dataset",
    default=None,
    metavar="NAME",
    help="Models of this one. [the newest trained on]",
    shell_complete=dataset_names,
)
@click.option("--split", default="repetitions", show_default=True, help="Of models named without a version.")
@click.option("--metric", default="force_nrmse", show_default=True, metavar="M|all", help="In which, or in all eight.")
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), help="Draw the first comparison into FILE.png.")
@db_option
@json_option
def compare(
    names: tuple[str, ...],
    dataset: str | None,
    split: str,
    metric: str,
    out: Path | None,
    db: str,
    json_to: str | None,
) -> None:
    """Compare models on the held-out pulses they have in common: which is better, where, whether beyond chance.

    Each with each; without a name, the best of the split with all others. Intervals are 90 %, by configuration.
    The settings that each training searched and found are listed side by side.

    \b
    Example:
        pyroshock compare hybrid coregional-gp --metric cost
        pyroshock compare hybrid@3 hybrid@7 --out difference.png
    """
    with opened(db) as store:
        from ..library.training import compare_versions
        from ..models.comparing import draw, metrics_named, rows_of, told

        wanted = metrics_named(metric)
        comparison = compare_versions(store, db, names, dataset=dataset, split=split, metric=wanted[0], note=note)
        if out is not None:
            draw(comparison.comparisons[0], wanted[0], out)
            note(f"plot: {out}")
        if json_to is not None:
            write_json(rows_of(comparison, wanted), json_to)
            return
        click.echo(f"{len(comparison.judged.pulses)} held-out pulses that none of them was trained on")
        print_table(comparison.table(wanted), "")
        for line in told(comparison, wanted):
            click.echo(line)
        if settings := comparison.settings_table():
            click.echo("What each training searched and found:")
            print_table(settings, "")
