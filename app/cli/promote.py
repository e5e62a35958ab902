"""`promote`: the model in use."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from .common import db_option, json_option, note, opened, write_json
from .completion import model_versions

if TYPE_CHECKING:
    from ...training.records import Decision


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
        from dataclasses import asdict

        from ...training.listing import chosen
        from ...training.promotion import promote as promote_version
        from ..models.training import models_extra, pulses_on, reader_of, registry_of

        name, number = _version(model, version)
        with models_extra():
            registry = registry_of(db)
            candidate = chosen(registry.versions(), f"{name}@{number}")
            on = (other, pulses_on(store, other, candidate)) if other is not None else None
            decision = promote_version(registry, name, number, reader_of(store), other=on, forced=force, reason=reason)
        if json_to is not None:
            write_json(asdict(decision), json_to)
        note(_words(decision))
        if not decision.promoted:
            raise click.exceptions.Exit(1)


def _version(model: str, version: int | None) -> tuple[str, int]:
    """`hybrid@3`, or `hybrid 3`. Raises `ValueError` for another text."""
    name, at, number = model.partition("@")
    if (at == "@") == (version is not None) or (at and not number.isdecimal()):
        raise ValueError(f"model is {model!r}; expected MODEL@VERSION, such as hybrid@3")
    return name, version if version is not None else int(number)


def _words(decision: Decision) -> str:
    """ "hybrid@3 is now in use for the gun (none before)"; and why, and what it was judged on."""
    kind, candidate, champion = decision.predictor_set, decision.candidate, decision.champion
    why = f": {decision.reason}" if decision.reason else ""
    judged = f" (judged on {decision.pulses} pulses, {decision.judged_on})" if decision.pulses else ""
    if not decision.promoted:
        stays = f"{champion} stays in use" if champion else "no model is in use"
        return f"{candidate} is refused, {stays} for the {kind}{why}{judged}"
    if champion == candidate:
        return f"{candidate} is in use for the {kind}, as before"
    before = f"{champion} before" if champion else "none before"
    return f"{candidate} is now in use for the {kind} ({before}){why}{judged}"
