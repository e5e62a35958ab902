"""`validate`: measured shots beside predictions of a twin that had not seen them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ...common.progress import progress_bar
from ..command_line.common import (
    db_option,
    json_option,
    note,
    open_command_store,
    print_table,
    write_json,
)
from ..command_line.completion import campaign_names, contact_models
from ..command_line.next_step import suggest_next


@click.command()
@click.argument("campaign", shell_complete=campaign_names)
@click.option(
    "--contact",
    metavar="LAW|prior|registered|MODEL@VERSION",
    default=None,
    help="Choose the contact model as `predict` does.",
    shell_complete=contact_models,
)
@click.option(
    "--folds",
    type=click.IntRange(2),
    default=5,
    show_default=True,
    help="Set the number of folds; a fold leaves out whole configurations.",
)
@click.option(
    "--draws",
    type=click.IntRange(20),
    default=64,
    show_default=True,
    help="Set the number of random draws that the bands are computed from.",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Set the seed: the same seed gives the same answer.",
)
@click.option(
    "--out",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write the report to FILE.html or FILE.pdf.",
)
@db_option
@json_option
def validate(
    campaign: str,
    contact: str | None,
    folds: int,
    draws: int,
    seed: int,
    out: Path | None,
    db: str,
    json_to: str | None,
) -> None:
    """Show how far predictions can be trusted: measured shots beside predictions that had not seen
    them.

    The configurations of a campaign are divided into folds. The twin predicts the shots of each
    fold after it has learned from all other shots. The exit code is 1 if the 90 % bands are too
    narrow ("Not calibrated").

    \b
    Example:
        pyroshock validate rehearsal --folds 2 --draws 20 --out validation.html
    """
    progress = progress_bar(f"Predicting the shots of {campaign} from the others", "shots")
    with open_command_store(db) as store:
        from ...operations.validate.service import validate_twin

        if out is not None:
            from ...documents.write import check_ending

            check_ending(out)
        with progress as step:
            validation = validate_twin(store, db, campaign, contact, folds, draws, seed, step)
        data = validation.to_json()
        if out is not None:
            from ...documents.write import write_report
            from ...operations.validate.report import validation_document

            write_report(validation_document(data), out)
            note(f"written: {out}")
        if json_to is not None:
            write_json(data, json_to)
        else:
            _show(data)
        if validation.calibrated:
            suggest_next("tune", "--target", "SPEC.csv", "--measured", campaign)
        else:
            suggest_next("diagnose", campaign)
        if not validation.calibrated:
            raise click.exceptions.Exit(1)


def _show(data: dict[str, Any]) -> None:
    from ...operations.validate.validation import (
        adopted_lines,
        failure_lines,
        reason_lines,
        score_rows,
    )

    click.echo(f"{data['campaign']}: {data['verdict']}")
    click.echo(f"What the predictions had seen: {data['seen']}.")
    click.echo()
    print_table(score_rows(data), "")
    if data["failures"]:
        click.echo("\nWhere the predictions fail")
        for line in failure_lines(data):
            click.echo(f"  {line}")
    if adopted := adopted_lines(data):
        click.echo("\nWith the adopted effects")
        for line in adopted:
            click.echo(f"  {line}")
    for line in reason_lines(data["left_out"]):
        note(f"not compared: {line}")
    for line in data["notes"]:
        note(line)
