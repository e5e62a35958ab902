"""`models`: list, show or delete the registered models."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from ...common.progress import progress_bar
from ...operations.train.stored_models import MODEL_DELETE, MODEL_RECOVER, MODEL_SHOW
from ..command_line.common import (
    db_option,
    errors_as_one_line,
    note,
    print_table,
    write_json,
)
from ..command_line.completion import dataset_names
from ..command_line.listed import Listing, listing_options
from ..command_line.nouns import noun_group
from ..command_line.operation_command import command_of

if TYPE_CHECKING:
    from ....dataset.catalog import Withdrawal
    from ....training.registry.records import Version


@click.command()
@click.option(
    "--dataset",
    default=None,
    metavar="NAME",
    help="List only models that were trained on this dataset.",
    shell_complete=dataset_names,
)
@click.option("--split", default=None, help="List only models that were judged on this split.")
@click.option("--all", "every", is_flag=True, help="List older versions, too.")
@click.option(
    "--promotions",
    is_flag=True,
    help="List promotions and refusals with the person, the time and the reason.",
)
@db_option
@listing_options
def list_models(
    dataset: str | None,
    split: str | None,
    every: bool,
    promotions: bool,
    db: str,
    listing: Listing,
) -> None:
    """List the registered models, the best first, with their figures on both splits; show or delete
    one.

    The list names the floor that repetitions set, and the figures of the thesis. `pyroshock models
    MODEL@VERSION` shows one version with its figures and the settings that its training searched
    and chose.

    A star marks the model in use. Errors are shares, as means over held-out pulses; --json gives
    all metrics with intervals. With --csv, --sort or --columns there is one row for each version,
    with its metrics as columns.

    \b
    Example:
        pyroshock models --dataset rehearsal-pulses
        pyroshock models gp@1
        pyroshock models --sort force_nrmse --columns model,version,split,force_nrmse
        pyroshock models --promotions
    """
    progress = progress_bar("Reading the models of the registry")
    with errors_as_one_line():
        from ....training.registry.intact_models import damages
        from ....training.registry.listing import flat_row, newest, of_dataset
        from ....training.registry.usability import usability
        from ...common.model_registry import (
            models_extra,
            registry_of,
            withdrawals_at,
            withdrawn_words,
        )
        from ...common.registered_models import lost_at
        from ...operations.train.tables import floors_by_ground, json_row

        registry = registry_of(db)
        with models_extra(), progress:
            decisions, versions = (
                (registry.decisions(), []) if promotions else ([], registry.versions())
            )
            versions = of_dataset(versions, dataset) if dataset is not None else versions
            versions = [version for version in versions if split in (None, version.split)]
            floors = floors_by_ground(registry, versions)
            listed = versions if every else newest(versions)
            wrong = damages(registry, listed)
        if promotions:
            _tell_promotions(decisions, listing)
            return
        if lost := lost_at(db, registry):
            note(lost)
        withdrawn = withdrawals_at(db) if listed else {}
        if listing.csv or listing.sort or listing.columns:
            listing.show(
                [flat_row(version) for version in listed],
                "no models yet; train some: pyroshock train DATASET",
            )
            return
        if listing.json_to is not None:
            rows = (
                (version, json_row(version, floors[version.dataset.hash, version.seed]))
                for version in listed
            )
            write_json(
                [
                    row | _damaged(wrong.get(version.run_id)) | _lost_pulses(version, withdrawn)
                    for version, row in rows
                ],
                listing.json_to,
            )
            return
        _tell(versions, floors, every)
        for version in listed:
            if reason := usability([version], floors[version.dataset.hash, version.seed]):
                note(reason)
        for row in listed:
            if row.run_id in wrong:
                note(f"{row.label} is damaged: {wrong[row.run_id]}")
        for words in withdrawn_words(withdrawn, listed):
            note(words)


def _lost_pulses(version: Version, withdrawn: dict[str, Withdrawal]) -> dict[str, int]:
    """Pulses that the model was trained on, or judged by, and that are no longer in the store."""
    withdrawal = withdrawn.get(version.dataset.hash)
    return {} if withdrawal is None else {"withdrawn_pulses": withdrawal.lost}


def _damaged(what: str | None) -> dict[str, str]:
    return {} if what is None else {"damaged": what}


def _tell(
    versions: list[Version], floors: dict[tuple[str, int], dict[str, str]], every: bool
) -> None:
    from ....training.registry.listing import row_of
    from ...operations.train.tables import table_of

    if not versions:
        click.echo("no models yet; train some: pyroshock train DATASET")
        return
    for (dataset_hash, seed), floors_by_split in floors.items():
        of_ground = [v for v in versions if (v.dataset.hash, v.seed) == (dataset_hash, seed)]
        click.echo(f"{of_ground[0].dataset.name} ({dataset_hash[:12]}), seed {seed}")
        print_table(table_of(of_ground, floors_by_split), "")
        click.echo()
    if every:
        columns = ("model", "version", "split", "dataset", "seed", "seconds", "registered_at")
        print_table(({name: row_of(version)[name] for name in columns} for version in versions), "")


def _tell_promotions(decisions: list[Any], listing: Listing) -> None:
    columns = (
        "when", "who", "candidate", "champion", "promoted", "forced", "judged_on", "judged_against",
        "pulses", "reason",
    )  # fmt: skip
    listing.show(
        [asdict(decision) for decision in decisions],
        "nothing was promoted yet: pyroshock promote MODEL@VERSION",
        lambda row: (
            {name: row[name] for name in columns} | {"when": f"{row['when']:%Y-%m-%d %H:%M}"}
        ),
    )


models = noun_group(
    list_models,
    {
        "show": command_of(MODEL_SHOW),
        "delete": command_of(MODEL_DELETE),
        "recover": command_of(MODEL_RECOVER),
    },
    list_models.help or "",
    otherwise="show",
)
