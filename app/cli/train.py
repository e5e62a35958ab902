"""`train`: models made from a dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from .common import db_option, fail, json_option, note, opened, print_table, write_json
from .completion import dataset_names
from .worker_options import crew_options

if TYPE_CHECKING:
    from ...parallel.executor import Crew
    from ...training.fitting.session import Session
    from ...training.models.catalogue import Budget


@click.command()
@click.argument("dataset", shell_complete=dataset_names)
@click.option("--models", default="all", show_default=True, metavar="A,B|all", help="Which, by name.")
@click.option(
    "--split",
    "splits",
    default="repetitions,configurations",
    show_default=True,
    metavar="S,T",
    help="What is held out: repetitions, configurations, treatments, materials, campaigns, material=NAME, "
    "campaign=NAME. The first flatters; see it beside the second.",
)
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="The same seed, the same models.")
@click.option(
    "--budget", type=click.Choice(["reduced", "full"]), default="reduced", show_default=True, help="Of the GA search."
)
@click.option("--retrain", is_flag=True, help="Train again what is registered already.")
@crew_options("Processes that train at once.")
@db_option
@json_option
def train(
    dataset: str,
    models: str,
    splits: str,
    seed: int,
    budget: Budget,
    retrain: bool,
    crew: Crew,
    db: str,
    json_to: str | None,
) -> None:
    """Train models on DATASET and register them, each judged on pulses that it has not seen.

    What is registered already is not trained again, so an interrupted training goes on by being started again.

    \b
    Example:
        pyroshock train spring
        pyroshock train spring --models hybrid,gp --split materials
        pyroshock train spring --backend dask --scheduler tcp://lab-1:8786
    """
    with opened(db) as store:
        from ...training.fitting.session import Progress
        from ..library.training import train_models
        from ..models.training import tell_beside_bar
        from ..progress import progress_bar

        with progress_bar("training", "models") as step:
            progress = Progress(step, tell_beside_bar)
            session, floors = train_models(
                store, db, dataset, [models], splits, seed=seed, budget=budget, retrain=retrain, crew=crew,
                progress=progress,
            )  # fmt: skip
        earlier = len(session.versions) - session.trained
        note(f"{session.trained} trained, {earlier} found as they were trained before")
        _tell(session, floors, json_to)
        if session.failures:
            fail(
                "not trained: "
                + "; ".join(f"{failure.model} ({failure.split}): {failure.reason}" for failure in session.failures)
            )


def _tell(session: Session, floors: dict[str, str], json_to: str | None) -> None:
    from ..models.tables import json_row, table_of

    if json_to is not None:
        write_json([json_row(version, floors) for version in session.versions], json_to)
    else:
        print_table(table_of(session.versions, floors), "nothing was trained")
