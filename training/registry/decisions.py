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
from typing import TYPE_CHECKING

from .reader import RegistryReader, RunRecord
from .records import Decision, Version
from .tags import DECISION_TAG, PREFIX, PROMOTED_TAG, decision_from, decision_tags

if TYPE_CHECKING:
    from mlflow import MlflowClient


ALIAS = "champion"


def alias_of(predictor_set: str) -> str:
    """The alias that decides; MLflow takes letters, digits, - and _."""
    return f"{ALIAS}-{re.sub(r'[^A-Za-z0-9_-]', '-', predictor_set)}"


def champions_of(
    tags: Mapping[tuple[str, int], Mapping[str, str]], aliases: Mapping[str, Mapping[str, int]]
) -> dict[tuple[str, int], str]:
    """(name, version) -> predictor set: of the carriers of a set's alias the one promoted last."""
    champions: dict[str, tuple[str, int]] = {}
    for key in sorted(tags, key=lambda key: tags[key].get(PROMOTED_TAG, "")):
        predictor_set = tags[key]["pyroshock.predictor_set"]
        if aliases.get(key[0], {}).get(alias_of(predictor_set)) == key[1]:
            champions[predictor_set] = key
    return {key: predictor_set for predictor_set, key in champions.items()}


def next_stamp(reader: RegistryReader) -> str:
    """The time of a promotion; where the clock was set back, a moment after the last one: it tells
    who came later."""
    stamps = (version.tags.get(PROMOTED_TAG) for version in reader.versions())
    times = [datetime.fromisoformat(stamp) for stamp in stamps if stamp]
    now = datetime.now(UTC)
    return max([now, *(time + timedelta(microseconds=1) for time in times)]).isoformat(
        timespec="microseconds"
    )


def crown(client: MlflowClient, reader: RegistryReader, version: Version, stamp: str) -> None:
    """Make this version the only champion of its predictor set. Cut short, it is done again with
    the same stamp."""
    alias, number = alias_of(version.dataset.predictor_set), str(version.version)
    # The stamp first: should this be cut short, two carry the alias, and the one promoted last
    # counts.
    client.set_model_version_tag(version.name, number, PROMOTED_TAG, stamp)
    for name in (alias, ALIAS):
        client.set_registered_model_alias(version.name, name, number)
    for model, aliases in reader.aliases().items():
        if model != version.name and alias in aliases:
            client.delete_registered_model_alias(model, alias)
            _move_or_drop(client, model, aliases, alias)


def is_champion(reader: RegistryReader, version: Version, stamp: str) -> bool:
    """Whether it carries its set's alias since the promotion of this stamp."""
    aliases = reader.aliases().get(version.name, {})
    if aliases.get(alias_of(version.dataset.predictor_set)) != version.version:
        return False
    return any(
        stored.tags.get(PROMOTED_TAG) == stamp
        for stored in reader.versions()
        if (stored.name, stored.version) == (version.name, version.version)
    )


def _move_or_drop(client: MlflowClient, name: str, aliases: Mapping[str, int], lost: str) -> None:
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


def decide(
    client: MlflowClient,
    reader: RegistryReader,
    experiment: str,
    decision: Decision,
    candidate: Version,
) -> None:
    """Keep a decision, and crown its candidate where it says so. One process at a time, after
    `settle`."""
    from mlflow.entities import Metric, Param

    stamp = next_stamp(reader)
    number = max((_number(run) for run in reader.runs_with(DECISION_TAG)), default=0) + 1
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
        crown(client, reader, candidate, stamp)
    client.set_terminated(run.info.run_id)


def settle(client: MlflowClient, reader: RegistryReader, versions: Sequence[Version]) -> None:
    """Complete what a killed promotion has begun, or take it back. One process at a time."""
    by_label = {version.label: version for version in versions}
    for run in reader.runs_with(DECISION_TAG):
        if not _is_open(run):
            continue
        candidate = by_label.get(decision_from(run.tags).candidate)
        if candidate is not None and is_champion(reader, candidate, run.tags[_STAMP_TAG]):
            crown(client, reader, candidate, run.tags[_STAMP_TAG])
            client.set_terminated(run.run_id)
        else:
            client.delete_run(run.run_id)


def decisions(reader: RegistryReader, versions: Sequence[Version]) -> list[Decision]:
    """Those that count, the newest first."""
    by_label = {version.label: version for version in versions}
    decisions = []
    for run in sorted(
        reader.runs_with(DECISION_TAG), key=lambda run: (_number(run), run.started_ms), reverse=True
    ):
        decision = decision_from(run.tags)
        candidate = by_label.get(decision.candidate)
        if _is_open(run) and (
            candidate is None or not is_champion(reader, candidate, run.tags[_STAMP_TAG])
        ):
            continue
        decisions.append(decision)
    return decisions


def _number(run: RunRecord) -> int:
    """The how-manieth decision; older software gave none."""
    return int(run.tags.get(_NUMBER_TAG, "0"))


def _is_open(run: RunRecord) -> bool:
    """Cut short. Older software moved the alias before it made the run."""
    return _STAMP_TAG in run.tags and run.status != "FINISHED"
