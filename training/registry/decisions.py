"""Promotions and refusals, each kept as a run of its own, so that it shows beside the trainings.

Decision and alias are two writes, and between them a process may be killed. So the run is made
first and left open; then the alias moves, stamped with the decision; then the run is closed. An
open decision counts where its candidate carries the alias with its stamp: wherever a promotion was
cut short, it was made, with its reason, or never asked for.

Aliases of the model in use.

One model name has versions for hammer and for gun, and MLflow gives a name one `champion`. So the
champion of a predictor set carries `champion-hammer` or `champion-gun`, which decides, and
`champion` beside it, by which people and other software find it; of a name that is champion of two
sets, `champion` is the one promoted last.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

from .records import Decision, Version
from .tags import DECISION_TAG, PREFIX, PROMOTED_TAG, decision_from, decision_tags

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Run

    from .records import Version


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
    """The time of a promotion; where the clock was set back, a moment after the last one: it tells
    who came later."""
    promoted = client.search_model_versions(f"tags.`{PROMOTED_TAG}` != ''", max_results=10_000)
    times = [datetime.fromisoformat(version.tags[PROMOTED_TAG]) for version in promoted]
    now = datetime.now(UTC)
    return max([now, *(time + timedelta(microseconds=1) for time in times)]).isoformat(
        timespec="microseconds"
    )


def crown(client: MlflowClient, version: Version, stamp: str) -> None:
    """Make this version the only champion of its predictor set. Cut short, it is done again with
    the same stamp."""
    alias, number = alias_of(version.dataset.predictor_set), str(version.version)
    # The stamp first: should this be cut short, two carry the alias, and the one promoted last
    # counts.
    client.set_model_version_tag(version.name, number, PROMOTED_TAG, stamp)
    for name in (alias, ALIAS):
        client.set_registered_model_alias(version.name, name, number)
    for model in client.search_registered_models(max_results=1000):
        if model.name != version.name and alias in model.aliases:
            client.delete_registered_model_alias(model.name, alias)
            _move_or_drop(client, model.name, model.aliases, alias)


def is_champion(client: MlflowClient, version: Version, stamp: str) -> bool:
    """Whether it carries its set's alias since the promotion of this stamp."""
    aliases = client.get_registered_model(version.name).aliases
    if str(aliases.get(alias_of(version.dataset.predictor_set))) != str(version.version):
        return False
    tags: Mapping[str, str] = client.get_model_version(version.name, str(version.version)).tags
    return tags.get(PROMOTED_TAG) == stamp


def _move_or_drop(client: MlflowClient, name: str, aliases: Mapping[str, Any], lost: str) -> None:
    """`champion` of a name that lost one of its thrones goes to another that it holds, or away."""
    kept = [
        number
        for alias, number in aliases.items()
        if alias.startswith(f"{ALIAS}-") and alias != lost
    ]
    if kept:
        client.set_registered_model_alias(name, ALIAS, str(kept[0]))
    elif ALIAS in aliases:
        client.delete_registered_model_alias(name, ALIAS)


_NUMBER_TAG, _STAMP_TAG = PREFIX + "decision_number", PREFIX + "decision_stamp"
_OF_RUN = (
    "candidate",
    "champion",
    "promoted",
    "forced",
    "reason",
    "judged_on",
    "judged_against",
    "verdict",
    "who",
)


def decide(client: MlflowClient, experiment: str, decision: Decision, candidate: Version) -> None:
    """Keep a decision, and crown its candidate where it says so. One process at a time, after
    `settle`."""
    from mlflow.entities import Metric, Param

    stamp = next_stamp(client)
    number = max((_number(run) for run in _runs(client, experiment)), default=0) + 1
    tags = decision_tags(decision) | {_STAMP_TAG: stamp, _NUMBER_TAG: str(number)}
    verb = "promote" if decision.promoted else "refuse"
    run = client.create_run(experiment, run_name=f"{verb} {decision.candidate}", tags=tags)
    parameters = [Param(name, str(getattr(decision, name))) for name in _OF_RUN]
    metrics = [
        Metric(name, value, run.info.start_time, 0) for name, value in decision.figures.items()
    ]
    client.log_batch(
        run.info.run_id, metrics, parameters
    )  # one request in place of one for each figure
    if decision.promoted:
        crown(client, candidate, stamp)
    client.set_terminated(run.info.run_id)


def settle(client: MlflowClient, experiment: str, versions: Sequence[Version]) -> None:
    """Complete what a killed promotion has begun, or take it back. One process at a time."""
    by_label = {version.label: version for version in versions}
    for run in _runs(client, experiment):
        if not _is_open(run):
            continue
        candidate = by_label.get(decision_from(run.data.tags).candidate)
        if candidate is not None and is_champion(client, candidate, run.data.tags[_STAMP_TAG]):
            crown(client, candidate, run.data.tags[_STAMP_TAG])
            client.set_terminated(run.info.run_id)
        else:
            client.delete_run(run.info.run_id)


def decisions(client: MlflowClient, experiment: str, versions: Sequence[Version]) -> list[Decision]:
    """Those that count, the newest first."""
    by_label = {version.label: version for version in versions}
    decisions = []
    for run in sorted(
        _runs(client, experiment), key=lambda run: (_number(run), run.info.start_time), reverse=True
    ):
        decision = decision_from(run.data.tags)
        candidate = by_label.get(decision.candidate)
        if _is_open(run) and (
            candidate is None or not is_champion(client, candidate, run.data.tags[_STAMP_TAG])
        ):
            continue
        decisions.append(decision)
    return decisions


def _runs(client: MlflowClient, experiment: str) -> list[Run]:
    return list(client.search_runs([experiment], f"tags.`{DECISION_TAG}` != ''", max_results=1000))


def _number(run: Run) -> int:
    """The how-manieth decision; older software gave none."""
    return int(run.data.tags.get(_NUMBER_TAG, "0"))


def _is_open(run: Run) -> bool:
    """Cut short. Older software moved the alias before it made the run."""
    return _STAMP_TAG in run.data.tags and run.info.status != "FINISHED"
