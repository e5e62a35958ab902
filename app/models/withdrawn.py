"""Models whose dataset lost pulses since they were trained: they work, and their data can no longer be shown whole."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from ...dataset.catalog import Withdrawal, list_withdrawals
from ...schema.session import StoreError, Writer, open_store

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...training.registry.records import Version


def withdrawals_at(url: str) -> dict[str, Withdrawal]:
    """Of the store at an address, by the dataset's hash; none where there is no store that can be read."""
    try:
        with open_store(url, Writer("models", "")) as store:
            return store.read(list_withdrawals)
    except StoreError:
        return {}


def withdrawn_words(withdrawals: dict[str, Withdrawal], versions: Iterable[Version]) -> list[str]:
    """A sentence for each dataset of the versions that lost pulses: which of them were trained on it."""
    labels: dict[str, list[str]] = {}
    for version in versions:
        if version.dataset.hash in withdrawals:
            labels.setdefault(version.dataset.hash, []).append(version.label)
    return [
        f"{_trained(names)} trained on data that is no longer whole: {withdrawals[key].words}"
        for key, names in labels.items()
    ]


def _trained(labels: Sequence[str]) -> str:
    return f"{', '.join(labels)} {'was' if len(labels) == 1 else 'were'}"


def note_of(session: Session | None, version: Version) -> str:
    """The sentence for one version, or nothing."""
    if session is None:
        return ""
    return "".join(withdrawn_words(list_withdrawals(session), [version]))
