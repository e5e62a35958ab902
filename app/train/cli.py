"""`train`: models made from a dataset. `compare`: which model is better. `promote`: the model in
use. `models`: what is registered."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..cli.common import (
    db_option,
    errors_as_one_line,
    fail,
    format_cell,
    json_option,
    note,
    open_command_store,
    print_table,
    worker_options,
    write_json,
)
from ..cli.completion import dataset_names, model_versions
from ..cli.listed import Listing, listing_options
from ..cli.next_step import suggest_next
from ..cli.options import split_names
from ..common.progress import progress_bar
from ..common.quantities import display_of

if TYPE_CHECKING:
    from ...dataset.catalog import Withdrawal
    from ...parallel.executor import ExecutorConfig
    from ...training.fitting.session import Session
    from ...training.models.catalogue import Budget
    from ...training.registry.records import Version
    from ...training.registry.registry import Registry
    from .comparing import Comparisons


@click.command()
@click.argument("dataset", shell_complete=dataset_names)
@click.option(
    "--models",
    multiple=True,
    callback=split_names,
    metavar="A,B|all",
    default=["all"],
    show_default=True,
    help="Train these models. Repeat the option, or give a list: a,b.",
)
@click.option(
    "--split",
    "splits",
    multiple=True,
    callback=split_names,
    metavar="S,T",
    help=(
        "Choose what is held out: repetitions, configurations, treatments, "
        "materials, campaigns, material=NAME or "
        "campaign=NAME. Held-out repetitions flatter a model; read them "
        "beside held-out configurations. Repeat the "
        "option, or give a list: s,t. [default: repetitions and "
        "configurations, as far as the dataset can be split so]"
    ),
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="Set the seed: the same seed gives the same models.",
)
@click.option(
    "--budget",
    type=click.Choice(["reduced", "full"]),
    default="reduced",
    show_default=True,
    help="Choose the size of the genetic search of settings.",
)
@click.option("--retrain", is_flag=True, help="Train again what is already registered.")
@worker_options("Set the number of processes that train.")
@db_option
@json_option
def train(
    dataset: str,
    models: tuple[str, ...],
    splits: tuple[str, ...],
    seed: int,
    budget: Budget,
    retrain: bool,
    executor: ExecutorConfig,
    db: str,
    json_to: str | None,
) -> None:
    """Train models on DATASET and register them; each is judged on pulses that it has not seen.

    A model that is registered already is not trained again, so that an interrupted training
    continues when it is started again.

    \b
    Example:
        pyroshock train rehearsal-pulses --models linear,hann
        pyroshock train rehearsal-pulses --models linear --split material=steel
    """
    bar = progress_bar(f"Training models on {dataset}", "models")
    with open_command_store(db) as store:
        from ...training.fitting.session import Progress
        from ..common.model_registry import tell_beside_bar
        from .service import train_models

        with bar as step:
            progress = Progress(step, tell_beside_bar)
            session, floors = train_models(
                store, db, dataset, models, ",".join(splits) or None, seed=seed, budget=budget,
                retrain=retrain,
                executor=executor, progress=progress,
            )  # fmt: skip
        earlier = len(session.versions) - session.trained
        note(f"{_models(session.trained)} trained now; {_models(earlier)} registered already")
        _train_tell(session, floors, json_to)
        _suggest_after_training(session, floors)
        if session.failures:
            fail(
                "not trained: "
                + "; ".join(
                    f"{failure.model} ({failure.split}): {failure.reason}"
                    for failure in session.failures
                )
            )


def _models(count: int) -> str:
    return f"{count} model{'' if count == 1 else 's'}"


def _suggest_after_training(session: Session, floors: dict[str, str]) -> None:
    from ...training.registry.usability import usability

    versions = session.versions
    if len({version.name for version in versions}) > 1:
        suggest_next(
            "compare", "--dataset", versions[0].dataset.name, "--split", versions[-1].split
        )
    elif versions and not any(usability([version], floors) for version in versions):
        suggest_next("promote", versions[-1].label)
    elif versions:
        suggest_next("train", versions[0].dataset.name)


def _train_tell(session: Session, floors: dict[str, str], json_to: str | None) -> None:
    from .tables import json_row, table_of

    if json_to is not None:
        write_json([json_row(version, floors) for version in session.versions], json_to)
    else:
        print_table(table_of(session.versions, floors), "nothing was trained")


@click.command()
@click.argument("names", nargs=-1, metavar="[MODEL[@VERSION]]...", shell_complete=model_versions)
@click.option(
    "--dataset",
    default=None,
    metavar="NAME",
    help="Compare models of this dataset. [default: the newest that was trained on]",
    shell_complete=dataset_names,
)
@click.option(
    "--split",
    default=None,
    help=(
        "Choose the split of models that are named without a version. "
        "[default: repetitions, or that of the newest "
        "model where none was judged on repetitions]"
    ),
)
@click.option(
    "--metric",
    default="force_nrmse",
    show_default=True,
    metavar="M|all",
    help="Compare by this measure, or by all eight.",
)
@click.option(
    "--plot",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Draw the first comparison into FILE.png.",
)
@click.option(
    "--out", "plot_as_before", type=click.Path(path_type=Path, dir_okay=False), hidden=True
)
@db_option
@json_option
def compare(
    names: tuple[str, ...],
    dataset: str | None,
    split: str | None,
    metric: str,
    plot: Path | None,
    plot_as_before: Path | None,
    db: str,
    json_to: str | None,
) -> None:
    """Compare models on the held-out pulses that they have in common: which is better, where, and
    whether beyond chance.

    Each model is compared with each other one. Without a name, the best of the split is compared
    with all others. Intervals are 90 %, by configuration. The settings that each training searched
    and chose are listed side by side.

    \b
    Example:
        pyroshock train rehearsal-pulses --models linear --split configurations
        pyroshock compare gp@1 linear@1 --metric cost --plot difference.png
    """
    progress = progress_bar("Comparing models on their held-out pulses")
    with open_command_store(db) as store:
        from .comparing import comparison_sentences, metrics_named, rows_of
        from .service import compare_versions

        wanted = metrics_named(metric)
        notes: list[str] = []
        with progress:
            comparison = compare_versions(
                store, db, names, dataset=dataset, split=split, metric=wanted[0], note=notes.append
            )
        for words in notes:
            note(words)
        if (file := plot or plot_as_before) is not None:
            from ..figures.matplotlib_renderer import write_figure
            from .charts import comparison_figure

            write_figure(comparison_figure(comparison.comparisons[0], wanted[0]), file)
            note(f"plot: {file}")
        if json_to is not None:
            write_json(rows_of(comparison, wanted), json_to)
            return
        click.echo(
            f"{len(comparison.judged.pulses)} held-out pulses on which none "
            f"of the models was trained"
        )
        print_table(comparison.table(wanted), "")
        for line in comparison_sentences(comparison, wanted):
            click.echo(line)
        if settings := comparison.settings_table():
            click.echo("What each training searched and found:")
            print_table(settings, "")
        _suggest_after_comparison(comparison, wanted[0])


def _suggest_after_comparison(comparison: Comparisons, metric: str) -> None:
    """A promotion where the verdict on unseen configurations allows it; else what would give such a
    verdict."""
    from .comparing import UNSEEN_SPLITS

    if (label := comparison.promotable(metric)) is not None:
        suggest_next("promote", label)
    elif comparison.split not in UNSEEN_SPLITS:
        note(
            "held-out repetitions do not decide which model is put in use; unseen configurations do"
        )
        names = list(dict.fromkeys(version.name for version in comparison.versions))
        dataset = comparison.versions[0].dataset.name
        suggest_next("train", dataset, "--models", ",".join(names), "--split", "configurations")
    else:
        note(
            "no version is better than the others beyond chance on unseen "
            "configurations: measure further "
            "configurations, and build a dataset with them"
        )


@click.command()
@click.argument("model", metavar="MODEL@VERSION", shell_complete=model_versions)
@click.argument("version", type=click.IntRange(1), required=False, metavar="")
@click.option(
    "--on",
    "other",
    default=None,
    metavar="DATASET|CAMPAIGN",
    help="Judge both models on the pulses of this dataset or campaign instead.",
)
@click.option(
    "--force",
    is_flag=True,
    help="Promote the model although it does not pass. This needs --reason.",
)
@click.option(
    "--reason",
    default="",
    metavar="TEXT",
    help="Say why. The registry keeps the reason beside the figures.",
)
@db_option
@json_option
def promote(
    model: str,
    version: int | None,
    other: str | None,
    force: bool,
    reason: str,
    db: str,
    json_to: str | None,
) -> None:
    """Put a model in use: predictions on benches of its kind (gun or hammer) take it from then on.

    The kind is that of the campaigns that the predictors of the model are for. If there are several
    sets of predictors for one kind, the model that was promoted last is in use. A model is promoted
    if, on configurations that it has not seen, its 90 % bands hold 85 to 97 % of the measured peak
    forces, contact times and impulses, and it predicts these better than the model in use, beyond
    chance. The first model must predict them better than the contact law updated by the measured
    shots, which answers without a model. The measure is the mean CRPS. Another model is refused,
    with exit code 1; exit code 3 means that there are too few configurations to judge it.
    `pyroshock models --promotions` lists refusals, too.

    \b
    Example:
        pyroshock promote gp@1
        pyroshock promote gp@1 --on slow-valve --reason "new tips"
    """
    label = f"{model}@{version}" if version is not None else model
    progress = progress_bar(f"Comparing {label} with the model in use")
    with open_command_store(db) as store:
        with progress:
            from .service import promote_version

            decision = promote_version(store, db, label, on=other, force=force, reason=reason)
        if json_to is not None:
            write_json(decision.to_json(), json_to)
        note(decision.sentence)
        if decision.promoted:
            suggest_next("predict")
        elif (champion := decision.decision.champion) is not None:
            suggest_next(
                "compare", decision.decision.candidate, champion, "--split", "configurations"
            )
        if not decision.promoted:
            raise click.exceptions.Exit(
                3 if decision.decision.verdict == "not enough to judge" else 1
            )


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
        from ...training.registry.intact_models import damages
        from ...training.registry.listing import flat_row, newest, of_dataset
        from ...training.registry.usability import usability
        from ..common.model_registry import (
            models_extra,
            registry_of,
            withdrawals_at,
            withdrawn_words,
        )
        from ..common.registered_models import lost_at
        from .tables import floors_by_ground, json_row

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
    from .searches import importance_of, importance_sentence, search_sentence
    from .tables import json_row

    row = json_row(version, registry.floors(version.dataset.hash, version.seed))
    settings = registry.fit_settings(version)
    searches = registry.searches(version)
    if plot is not None:
        if not searches:
            raise LookupError(
                f"{version.label} has no trials to draw: nothing was "
                f"searched, or older software trained it"
            )
        from ..figures.matplotlib_renderer import write_figure
        from .charts import searches_figure

        write_figure(searches_figure(searches), plot)
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
        click.echo(
            f"\n{search_sentence(part, search)}\n{importance_sentence(search, importance_of(search))}"
        )


def _lost_pulses(version: Version, withdrawn: dict[str, Withdrawal]) -> dict[str, int]:
    """Pulses that the model was trained on, or judged by, and that are no longer in the store."""
    withdrawal = withdrawn.get(version.dataset.hash)
    return {} if withdrawal is None else {"withdrawn_pulses": withdrawal.lost}


def _damaged(what: str | None) -> dict[str, str]:
    return {} if what is None else {"damaged": what}


def _tell(
    versions: list[Version], floors: dict[tuple[str, int], dict[str, str]], every: bool
) -> None:
    from ...training.registry.listing import row_of
    from .tables import table_of

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
