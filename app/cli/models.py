"""`models`: what is registered."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from .common import db_option, errors_as_one_line, note, print_table, write_json
from .completion import dataset_names, model_versions
from .listed import Listing, listing_options

if TYPE_CHECKING:
    from ...dataset.catalog import Withdrawal
    from ...training.registry.records import Version
    from ...training.registry.registry import Registry


@click.command()
@click.argument("version", required=False, metavar="[MODEL@VERSION]", shell_complete=model_versions)
@click.option(
    "--dataset", default=None, metavar="NAME", help="Only those trained on this one.", shell_complete=dataset_names
)
@click.option("--split", default=None, help="Only those judged on this one.")
@click.option("--all", "every", is_flag=True, help="Older versions too.")
@click.option("--promotions", is_flag=True, help="List promotions and refusals, with who, when and why.")
@db_option
@listing_options
def models(
    version: str | None,
    dataset: str | None,
    split: str | None,
    every: bool,
    promotions: bool,
    db: str,
    listing: Listing,
) -> None:
    """List the registered models, best first: both splits, the floor that repetitions set, the thesis's figures.

    With MODEL@VERSION, show that one: its figures, and the settings that its training searched and found.

    A star is the model in use. Errors are shares, means over held-out pulses; all metrics with intervals by --json.
    With --csv, --sort or --columns there is one row for each version, with its metrics as columns.

    \b
    Example:
        pyroshock models --dataset spring
        pyroshock models hybrid@3
        pyroshock models --sort force_nrmse --columns model,version,split,force_nrmse
        pyroshock models --promotions
    """
    with errors_as_one_line():
        from ...training.registry.intact_models import damages
        from ...training.registry.listing import chosen, flat_row, newest, of_dataset
        from ..models.tables import json_row
        from ..models.training import models_extra, registry_of
        from ..models.withdrawn import withdrawals_at, withdrawn_words

        registry = registry_of(db)
        with models_extra():
            if promotions:
                _tell_promotions(registry.decisions(), listing)
                return
            versions = registry.versions()
            if version is not None:
                _tell_version(registry, chosen(versions, version), listing.json_to)
                return
            versions = of_dataset(versions, dataset) if dataset is not None else versions
            versions = [version for version in versions if split in (None, version.split)]
            floors = {ground: registry.floors(*ground) for ground in _grounds(versions)}
            listed = versions if every else newest(versions)
            wrong = damages(registry, listed)
        withdrawn = withdrawals_at(db) if listed else {}
        if listing.csv or listing.sort or listing.columns:
            listing.show(
                [flat_row(version) for version in listed], "no models yet; train some: pyroshock train DATASET"
            )
            return
        if listing.json_to is not None:
            rows = ((version, json_row(version, floors[version.dataset.hash, version.seed])) for version in listed)
            write_json(
                [row | _damaged(wrong.get(version.label)) | _lost(version, withdrawn) for version, row in rows],
                listing.json_to,
            )
            return
        _tell(versions, floors, every)
        for label, what in wrong.items():
            note(f"{label} is damaged: {what}")
        for words in withdrawn_words(withdrawn, listed):
            note(words)


def _tell_version(registry: Registry, version: Version, json_to: str | None) -> None:
    """One version's figures and settings; its histories, by step, stand in the JSON alone."""
    from ..models.tables import json_row

    row = json_row(version, registry.floors(version.dataset.hash, version.seed))
    settings = registry.fit_settings(version)
    if json_to is not None:
        write_json(row | {"settings": settings, "histories": registry.fit_histories(version)}, json_to)
        return
    click.echo(f"{version.label}, dataset {version.dataset.name}, split {version.split}, seed {version.seed}")
    print_table(({"metric": name, "mean": mean} for name, mean in row["metrics"].items()), "")
    click.echo()
    rows = ({"setting": name, "value": value} for name, value in settings.items())
    print_table(rows, "no settings: nothing was searched, or older software trained it")


def _lost(version: Version, withdrawn: dict[str, Withdrawal]) -> dict[str, int]:
    """Pulses that the model was trained on, or judged by, and that are no longer in the store."""
    withdrawal = withdrawn.get(version.dataset.hash)
    return {} if withdrawal is None else {"withdrawn_pulses": withdrawal.lost}


def _damaged(what: str | None) -> dict[str, str]:
    return {} if what is None else {"damaged": what}


def _grounds(versions: list[Version]) -> list[tuple[str, int]]:
    return list(dict.fromkeys((version.dataset.hash, version.seed) for version in versions))


def _tell(versions: list[Version], floors: dict[tuple[str, int], dict[str, str]], every: bool) -> None:
    from ...training.registry.listing import row_of
    from ..models.tables import table_of

    if not versions:
        click.echo("no models yet; train some: pyroshock train DATASET")
        return
    for key in _grounds(versions):
        of_it = [version for version in versions if (version.dataset.hash, version.seed) == key]
        click.echo(f"{of_it[0].dataset.name} ({key[0][:12]}), seed {key[1]}")
        print_table(table_of(of_it, floors[key]), "")
        click.echo()
    if every:
        columns = ("model", "version", "split", "dataset", "seed", "seconds", "registered_at")
        print_table(({name: row_of(version)[name] for name in columns} for version in versions), "")


def _tell_promotions(decisions: list[Any], listing: Listing) -> None:
    from dataclasses import asdict

    columns = (
        "when", "who", "candidate", "champion", "promoted", "forced", "judged_on", "judged_against", "pulses", "reason",
    )  # fmt: skip
    listing.show(
        [asdict(decision) for decision in decisions],
        "nothing was promoted yet: pyroshock promote MODEL VERSION",
        lambda row: {name: row[name] for name in columns} | {"when": f"{row['when']:%Y-%m-%d %H:%M}"},
    )
