"""`promote`: the model in use."""

from __future__ import annotations

import click

from .common import db_option, json_option, note, opened, write_json
from .completion import model_versions


@click.command()
@click.argument("model", metavar="MODEL@VERSION", shell_complete=model_versions)
@click.argument("version", type=click.IntRange(1), required=False, metavar="")
@click.option("--on", "other", default=None, metavar="DATASET|CAMPAIGN", help="Judge both on its pulses instead.")
@click.option("--force", is_flag=True, help="Promote it though it is worse; needs --reason.")
@click.option("--reason", default="", metavar="TEXT", help="Why; it is kept beside the figures.")
@db_option
@json_option
def promote(
    model: str, version: int | None, other: str | None, force: bool, reason: str, db: str, json_to: str | None
) -> None:
    """Put a model in use: predictions on benches of its kind (a gun, a hammer) take it from then on.

    The kind is that of the campaigns that the model's predictors are for. Of several predictor sets for one kind, the
    model that was promoted last is in use. It must predict configurations that it has not seen better than the model in
    use, and the first model better than what answers without one: the contact law updated by the measured shots. The
    measure is the mean CRPS of peak force, contact time and impulse. Else it is refused, with exit code 1. Refusals are
    kept too: pyroshock models --promotions.

    \b
    Example:
        pyroshock promote hybrid@3
        pyroshock promote hybrid@5 --on autumn --reason "new tips"
    """
    with opened(db) as store:
        from ..library.training import promote_version

        decision = promote_version(
            store, db, f"{model}@{version}" if version is not None else model, on=other, force=force, reason=reason
        )
        if json_to is not None:
            write_json(decision.to_json(), json_to)
        note(decision.sentence)
        if not decision.promoted:
            raise click.exceptions.Exit(1)
