"""Aliases of the model in use.

One model name has versions for hammer and for gun, and MLflow gives a name one `champion`. So the champion of a
predictor set carries `champion-hammer` or `champion-gun`, which decides, and `champion` beside it, by which people and
other software find it; of a name that is champion of two sets, `champion` is the one promoted last.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

from .tags import PROMOTED_TAG

if TYPE_CHECKING:
    from mlflow import MlflowClient

    from ..records import Version

ALIAS = "champion"


def alias_of(predictor_set: str) -> str:
    """The alias that decides; MLflow takes letters, digits, - and _."""
    return f"{ALIAS}-{re.sub(r'[^A-Za-z0-9_-]', '-', predictor_set)}"


def champions_of(
    tags: Mapping[tuple[str, int], Mapping[str, str]], aliases: Mapping[str, Mapping[str, str]]
) -> dict[tuple[str, int], str]:
    """(name, version) -> predictor set: of the carriers of a set's alias the one promoted last."""
    champions: dict[str, tuple[str, int]] = {}
    for key in sorted(tags, key=lambda key: tags[key].get(PROMOTED_TAG, "")):
        predictor_set = tags[key]["pyroshock.predictor_set"]
        if str(aliases.get(key[0], {}).get(alias_of(predictor_set))) == str(key[1]):
            champions[predictor_set] = key
    return {key: predictor_set for predictor_set, key in champions.items()}


def next_stamp(client: MlflowClient) -> str:
    """The time of a promotion; where the clock was set back, a moment after the last one: it tells who came later."""
    promoted = client.search_model_versions(f"tags.`{PROMOTED_TAG}` != ''", max_results=10_000)
    times = [datetime.fromisoformat(version.tags[PROMOTED_TAG]) for version in promoted]
    now = datetime.now(UTC)
    return max([now, *(time + timedelta(microseconds=1) for time in times)]).isoformat(timespec="microseconds")


def crown(client: MlflowClient, version: Version, stamp: str) -> None:
    """Make this version the only champion of its predictor set. Cut short, it is done again with the same stamp."""
    alias, number = alias_of(version.dataset.predictor_set), str(version.version)
    # The stamp first: should this be cut short, two carry the alias, and the one promoted last counts.
    client.set_model_version_tag(version.name, number, PROMOTED_TAG, stamp)
    for name in (alias, ALIAS):
        client.set_registered_model_alias(version.name, name, number)
    for model in client.search_registered_models(max_results=1000):
        if model.name != version.name and alias in model.aliases:
            client.delete_registered_model_alias(model.name, alias)
            _move_or_drop(client, model.name, model.aliases, alias)


def is_crowned(client: MlflowClient, version: Version, stamp: str) -> bool:
    """Whether it carries its set's alias since the promotion of this stamp."""
    aliases = client.get_registered_model(version.name).aliases
    if str(aliases.get(alias_of(version.dataset.predictor_set))) != str(version.version):
        return False
    tags: Mapping[str, str] = client.get_model_version(version.name, str(version.version)).tags
    return tags.get(PROMOTED_TAG) == stamp


def _move_or_drop(client: MlflowClient, name: str, aliases: Mapping[str, Any], lost: str) -> None:
    """`champion` of a name that lost one of its thrones goes to another that it holds, or away."""
    kept = [number for alias, number in aliases.items() if alias.startswith(f"{ALIAS}-") and alias != lost]
    if kept:
        client.set_registered_model_alias(name, ALIAS, str(kept[0]))
    elif ALIAS in aliases:
        client.delete_registered_model_alias(name, ALIAS)
