"""`models`: list, show or delete the registered models."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...common.progress import progress_bar
from ...common.quantities import display_of
from ..command_line.common import (
    db_option,
    errors_as_one_line,
    format_cell,
    json_option,
    note,
    open_command_store,
    print_table,
    write_json,
)
from ..command_line.completion import dataset_names, model_versions
from ..command_line.listed import Listing, listing_options
from ..command_line.nouns import noun_group
from ..command_line.options import confirm_deletion, deletion_options

if TYPE_CHECKING:
    from ....dataset.catalog import Withdrawal
    from ....training.registry.records import Version
    from ....training.registry.registry import Registry


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


def tell_version(
    registry: Registry, version: Version, json_to: str | None, plot: Path | None = None
) -> None:
    """One version's figures and settings; its histories, by step, and every trial of its searches
    stand in the JSON alone. `plot`: draw the trials there. Raises `LookupError` for a plot of a
    version without trials."""
    from ...operations.train.searches import (
        draw_searches,
        importance_of,
        importance_sentence,
        search_sentence,
    )
    from ...operations.train.tables import json_row

    row = json_row(version, registry.floors(version.dataset.hash, version.seed))
    settings = registry.fit_settings(version)
    searches = registry.searches(version)
    if plot is not None:
        if not searches:
            raise LookupError(
                f"{version.label} has no trials to draw: nothing was "
                f"searched, or older software trained it"
            )
        draw_searches(searches, plot)
        note(f"plot: {plot}")
    if json_to is not None:
        trials = {part: search.as_json() for part, search in searches.items()}
        write_json(
            row
            | {
                "settings": settings,
                "histories": registry.fit_histories(version),
                "searches": trials,
            },
            json_to,
        )
        return
    click.echo(
        f"{version.label}, dataset {version.dataset.name}, split "
        f"{version.split}, seed {version.seed}"
    )
    shown = {name: display_of(name) for name in row["metrics"]}
    figures = ((shown[name], mean) for name, mean in row["metrics"].items())
    print_table(
        ({"metric": item.heading, "mean": format_cell(mean, item.scale)} for item, mean in figures),
        "",
    )
    click.echo()
    rows = ({"setting": name, "value": value} for name, value in settings.items())
    print_table(rows, "no settings: nothing was searched, or older software trained it")
    for part, search in searches.items():
        importance = importance_sentence(search, importance_of(search))
        click.echo(f"\n{search_sentence(part, search)}\n{importance}")


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


@click.command()
@click.argument("model", metavar="MODEL@VERSION", shell_complete=model_versions)
@click.option(
    "--plot",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Draw the trials of the search for settings, and the importance of each "
    "setting, into FILE.png.",
)
@db_option
@json_option
def show(model: str, plot: Path | None, db: str, json_to: str | None) -> None:
    """Show one version of a model: its figures, and the settings that its training searched and
    chose.

    `MODEL@champion` is the version in use, and MODEL alone is the newest version. The JSON has
    every trial of the search with its settings, its score and its duration in seconds.

    \b
    Example:
        pyroshock models show gp@1 --plot search.png
    """
    progress = progress_bar(f"Reading model {model} of the registry")
    with errors_as_one_line():
        from ....training.registry.listing import chosen
        from ...common.model_registry import models_extra, registry_of

        registry = registry_of(db)
        with models_extra():
            with progress:
                version = chosen(registry.versions(), model)
            tell_version(registry, version, json_to, plot)


@click.command()
@click.argument("model", metavar="MODEL@VERSION", shell_complete=model_versions)
@db_option
@deletion_options
def delete(model: str, db: str, dry_run: bool) -> None:
    """Delete one version of a model from the registry. The model in use is refused.

    The number of a deleted version is not given again. Predictions, diagnoses and reports that were
    made with it stay.

    \b
    Example:
        pyroshock train rehearsal-pulses --models linear --split configurations
        pyroshock models delete linear@1 --yes
    """
    with errors_as_one_line():
        from ...operations.train.deletion import delete_version, unused_version

        label = unused_version(db, model).label
        if dry_run:
            note(f"model {label} can be deleted; nothing was deleted")
            return
        confirm_deletion(f"model {label}")
        delete_version(db, label)
    note(f"model {label} is deleted")


@click.command()
@db_option
def recover(db: str) -> None:
    """Register the surviving files of versions again that the store lists and the registry has
    lost.

    Every file is held against the SHA-256 that was registered of it. Numbers of versions are kept
    where they are free. No model is put in use: promote the one that was. Histories of trainings
    and promotions are not in the files.

    \b
    Example:
        pyroshock models recover
    """
    with open_command_store(db) as store:
        from ...common.model_registry import models_extra, registry_of
        from ...common.registered_models import recover_lost

        count = 0
        with models_extra():
            for label, outcome in recover_lost(store, registry_of(db)):
                note(f"{label} {outcome}")
                count += 1
    if count == 0:
        note("nothing is lost: the registry has every version that the store lists")


models = noun_group(
    list_models,
    {"show": show, "delete": delete, "recover": recover},
    list_models.help or "",
    otherwise="show",
)
