"""`promote`: the model in use."""

from __future__ import annotations

import click

from .common import db_option, json_option, note, opened, write_json


@click.command()
@click.argument("model")
@click.argument("version", type=click.IntRange(1))
@click.option("--on", "other", default=None, metavar="DATASET|CAMPAIGN", help="Judge both on its pulses instead.")
@click.option("--force", is_flag=True, help="Promote it though it is worse; needs --reason.")
@click.option("--reason", default="", metavar="TEXT", help="Why; it is kept beside the figures.")
@db_option
@json_option
def promote(
    model: str, version: int, other: str | None, force: bool, reason: str, db: str, json_to: str | None
) -> None:
    """Put VERSION of MODEL in use: predictions take it from then on.

    It must predict configurations that it has not seen better than the model in use, and the first model better than
    the contact of which nothing was learned: by the mean CRPS of peak force, contact time and impulse. Else it is
    refused, with exit code 1. Refusals are kept too: pyroshock models --promotions.

    \b
    Example:
        pyroshock promote hybrid 3
        pyroshock promote hybrid 5 --on autumn --reason "new tips"
    """
    with opened(db) as store:
        from dataclasses import asdict

        from ...training.listing import chosen
        from ...training.promotion import promote as promote_version
        from ..models.training import models_extra, pulses_on, reader_of, registry_of

        with models_extra():
            registry = registry_of(db)
            candidate = chosen(registry.versions(), f"{model}@{version}")
            on = (other, pulses_on(store, other, candidate)) if other is not None else None
            decision = promote_version(
                registry, model, version, reader_of(store), other=on, forced=force, reason=reason
            )
        if json_to is not None:
            write_json(asdict(decision), json_to)
        before = f"before: {decision.champion}" if decision.champion else "none before"
        state = f"is now in use for the {decision.predictor_set} ({before})" if decision.promoted else "is refused"
        judged = f" (judged on {decision.pulses} pulses, {decision.judged_on})" if decision.pulses else ""
        note(f"{decision.candidate} {state}: {decision.reason}{judged}")
        if not decision.promoted:
            raise click.exceptions.Exit(1)
