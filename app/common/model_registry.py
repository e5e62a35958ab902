"""What the commands around models share: the registry of a store, its datasets as training takes
them, and the models whose dataset lost pulses since: they work, and their data can no longer be
shown whole."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from ...dataset.catalog import Withdrawal, list_withdrawals
from ...schema.session import StoreError, Writer, open_store
from ...training.registry.connection import user_environment
from ...training.registry.model_storage import storage_for

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ...dataset.table import PulseTable
    from ...schema.session import Store
    from ...training.fitting.fitting import TrainingContext, TrainingFigures
    from ...training.models.catalogue import Budget
    from ...training.registry.records import Version
    from ...training.registry.registry import Registry


#: What `pyroshock[models]` brings.
_EXTRA = frozenset({"mlflow", "torch", "gpytorch", "linear_operator", "sklearn", "skops", "optuna"})


class MissingExtraError(ValueError):
    """A library is not installed that training and the registry stand on."""


@contextmanager
def models_extra() -> Iterator[None]:
    """Say how to install what is missing, in place of a failed import."""
    try:
        yield
    except ModuleNotFoundError as error:
        name = (error.name or "").partition(".")[0]
        if name not in _EXTRA:
            raise
        raise MissingExtraError(
            f"{name} is not installed; models need it: pip install 'pyroshock[models]'"
        ) from error


def registry_of(store_url: str) -> Registry:
    """The registry beside a store, or where MLFLOW_TRACKING_URI says."""
    from ...training.registry.registry import Registry

    return Registry(storage_for(store_url, user_environment()))


def registry_at(store_url: str) -> Registry | None:
    """The registry beside a store; None where nothing was trained yet, without a look at MLflow."""
    registry = registry_of(store_url)
    return None if registry.connection.nothing_there else registry


def needed(store_url: str) -> Registry:
    """The registry beside a store. Raises `LookupError` where nothing was trained yet."""
    registry = registry_at(store_url)
    if registry is None:
        raise LookupError("no models yet; train some: pyroshock train DATASET")
    return registry


def context_of(
    store: Store,
    dataset: str,
    registry: Registry,
    seed: int,
    budget: Budget,
    figures: TrainingFigures | None = None,
) -> TrainingContext:
    """A dataset of the store, to train on; `figures` draws what stands beside each model, by
    default nothing."""
    from ...dataset.snapshot import read_snapshot
    from ...dataset.velocities import kind_of_snapshot
    from ...training.fitting.fitting import TrainingContext
    from ...training.registry.records import DatasetName

    snapshot = read_snapshot(store, dataset)
    with store.reading() as session:
        velocity = kind_of_snapshot(session, snapshot.hash, snapshot.definition)
    name = DatasetName(
        snapshot.name, snapshot.hash, snapshot.predictors.name, snapshot.predictors.kind, velocity
    )
    return TrainingContext(name, snapshot.table, seed, budget, registry.place.work, figures)


def splits_of(table: PulseTable, texts: str) -> list[str]:
    """Split texts from a comma list; "materials" and "campaigns" become one for each. Raises as
    `split_of`."""
    from ...dataset.table import expand, split_of

    chosen = [
        expanded
        for text in texts.split(",")
        if text.strip()
        for expanded in expand(table, text.strip())
    ]
    if not chosen:
        raise ValueError(f"--split {texts!r} names no split of this dataset")
    for text in chosen:
        split_of(table, text)
    return list(dict.fromkeys(chosen))


#: What a training holds out where nobody says it.
USUAL_SPLITS = ("repetitions", "configurations")


def usual_splits(table: PulseTable) -> str:
    """Those of `USUAL_SPLITS` that hold pulses of this dataset out, as a comma list. Raises as
    `split_of` for none."""
    from ...dataset.table import split_of

    possible = []
    for text in USUAL_SPLITS:
        try:
            split_of(table, text)
        except ValueError as error:
            refusal = error
        else:
            possible.append(text)
    if not possible:
        raise refusal
    return ",".join(possible)


def reader_of(store: Store) -> Callable[[str], PulseTable]:
    """Gives a dataset's pulses by its name or hash."""
    from ...dataset.snapshot import read_snapshot

    return lambda name: read_snapshot(store, name).table


def pulses_on(store: Store, name: str, like: Version) -> PulseTable:
    """The pulses of a dataset of this name; else the usable ones of a campaign, described as
    `like`'s were."""
    from ...dataset.selection import select_pulses
    from ...dataset.snapshot import list_snapshots, read_snapshot
    from ...dataset.velocities import CHOICES

    with store.reading() as session:
        datasets = {row["name"] for row in list_snapshots(session)}
        if name in datasets:
            return read_snapshot(session, name).table
        try:
            snapshot = read_snapshot(session, like.dataset.hash)
            stated = snapshot.definition.get("velocity") or {}
            named = {kind: choice for choice, kind in CHOICES.items()}
            velocity = named[stated["kind"]] if stated.get("converted") else None
            return select_pulses(
                session, [name], snapshot.predictors, "reject", None, velocity
            ).table
        except LookupError as error:
            raise LookupError(f"--on {name!r} is no dataset, and {error}") from error


def withdrawals_at(url: str) -> dict[str, Withdrawal]:
    """Of the store at an address, by the dataset's hash; none where there is no store that can be
    read."""
    try:
        with open_store(url, Writer("models", "")) as store:
            return store.read(list_withdrawals)
    except StoreError:
        return {}


def withdrawn_words(withdrawals: dict[str, Withdrawal], versions: Iterable[Version]) -> list[str]:
    """A sentence for each dataset of the versions that lost pulses: which of them were trained on
    it."""
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
