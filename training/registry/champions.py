"""Aliases of the model in use.

One model name has versions for hammer and for gun, and MLflow gives a name one `champion`. So the champion of a
predictor set carries `champion-hammer` or `champion-gun`, which decides, and `champion` beside it, by which people and
other software find it; of a name that is champion of two sets, `champion` is the one promoted last.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from mlflow import MlflowClient

ALIAS = "champion"

#: When a version was made champion, the last time.
PROMOTED_TAG = "pyroshock.promoted_at"


def alias_of(predictor_set: str) -> str:
    """The alias that decides; MLflow takes letters, digits, - and _."""
    return f"{ALIAS}-{re.sub(r'[^A-Za-z0-9_-]', '-', predictor_set)}"


def champions_of(
    tags: Mapping[tuple[str, int], Mapping[str, str]], aliases: Mapping[str, Mapping[str, str]]
) -> dict[tuple[str, int], str]:
    """(name, version) -> predictor set: of the carriers of a set's alias the one promoted last."""
    found: dict[str, tuple[str, int]] = {}
    for key in sorted(tags, key=lambda key: tags[key].get(PROMOTED_TAG, "")):
        predictor_set = tags[key]["pyroshock.predictor_set"]
        if str(aliases.get(key[0], {}).get(alias_of(predictor_set))) == str(key[1]):
            found[predictor_set] = key
    return {key: predictor_set for predictor_set, key in found.items()}


def move_or_drop(client: MlflowClient, name: str, aliases: Mapping[str, Any], lost: str) -> None:
    """`champion` of a name that lost one of its thrones goes to another that it holds, or away."""
    kept = [number for alias, number in aliases.items() if alias.startswith(f"{ALIAS}-") and alias != lost]
    if kept:
        client.set_registered_model_alias(name, ALIAS, str(kept[0]))
    elif ALIAS in aliases:
        client.delete_registered_model_alias(name, ALIAS)
