"""What a word on the command line means: a campaign, a diagnosis or a model, and the report on
it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from sqlalchemy import select

from ....schema.campaigns import Campaign
from ....schema.conditions import has_campaign
from ....schema.diagnoses import Diagnosis
from ....schema.listings import get_campaign_id
from ...documents.document import Document

if TYPE_CHECKING:
    from ....schema.session import Store

CAMPAIGN, DIAGNOSIS, MODEL = "campaign:", "diagnosis:", "models:/"


def report_on(store: Store, db: str, word: str) -> Document:
    """The report on a campaign (NAME or campaign:NAME), a diagnosis (diagnosis:ID, or
    diagnosis:CAMPAIGN: its newest) or a model (models:/NAME@VERSION or NAME@VERSION).

    A campaign's name comes first. Raises `LookupError` for what there is not, `ValueError` for a
    name that is both a campaign's and a model's, each naming the forms that are meant.
    """
    for start, report in _FORMS.items():
        if word.startswith(start):
            return report(store, db, word.removeprefix(start))
    if store.read(lambda session: has_campaign(session, word)):
        if word in _models(db):
            raise ValueError(
                f"{word!r} is a campaign and a model: say {CAMPAIGN}{word} or {MODEL}{word}@VERSION"
            )
        return _campaign(store, db, word)
    if "@" in word:
        return _model(store, db, word)
    if word in (models := _models(db)):
        labels = ", ".join(f"{MODEL}{word}@{number}" for number in models[word][:6])
        raise ValueError(f"{word!r} is a model; say which version: {labels}")
    campaigns = store.read(
        lambda session: session.scalars(
            select(Campaign.name).order_by(Campaign.name).limit(10)
        ).all()
    )
    raise LookupError(
        f"nothing is called {word!r}; campaigns: {', '.join(campaigns) or 'none'}; models: "
        f"{', '.join(models) or 'none'}; of a diagnosis say {DIAGNOSIS}ID or {DIAGNOSIS}CAMPAIGN"
    )


def _campaign(store: Store, _db: str, name: str) -> Document:
    from .campaign import campaign_document

    with store.reading() as session:
        return campaign_document(session, name)


def _diagnosis(store: Store, _db: str, which: str) -> Document:
    from ..diagnose.report import diagnosis_document

    with store.reading() as session:
        if which.isdigit():
            return diagnosis_document(session, int(which))
        of_it = Diagnosis.campaign_id == get_campaign_id(session, which)
        newest = session.scalar(
            select(Diagnosis.id).where(of_it).order_by(Diagnosis.id.desc()).limit(1)
        )
        if newest is None:
            raise LookupError(
                f"no diagnosis of {which!r} yet; make one: pyroshock diagnose {which}"
            )
        return diagnosis_document(session, newest)


def _model(store: Store, db: str, label: str) -> Document:
    from ....training.registry.listing import chosen
    from ...common.model_registry import models_extra, reader_of, registry_of
    from .model import model_document

    registry = registry_of(db)
    with models_extra():
        if "@" not in label:
            raise ValueError(
                f"{MODEL}{label} has no version; expected {MODEL}{label}@VERSION (pyroshock models)"
            )
        return model_document(registry, chosen(registry.versions(), label), reader_of(store))


_FORMS: dict[str, Callable[[Store, str, str], Document]] = {
    CAMPAIGN: _campaign,
    DIAGNOSIS: _diagnosis,
    MODEL: _model,
}


def _models(db: str) -> dict[str, list[int]]:
    """Versions by name, the newest first; none where there is no registry, or nothing that could
    read one."""
    from ...common.model_registry import MissingExtraError, models_extra, registry_of

    try:
        with models_extra():
            versions = registry_of(db).versions()
    except MissingExtraError:
        return {}
    kinds: dict[str, list[int]] = {}
    for version in versions:
        kinds.setdefault(version.name, []).append(version.version)
    return kinds
