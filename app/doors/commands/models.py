"""`models`: list, show or delete the registered models."""

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
)
from ..command_line.completion import model_versions
from ..command_line.nouns import noun_group
from ..command_line.options import confirm_deletion, deletion_options
from .train import list_models, tell_version


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
