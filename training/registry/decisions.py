"""Promotions and refusals, each kept as a run of its own, so that it shows beside the trainings.

Decision and alias are two writes, and between them a process may be killed. So the run is made first and left open;
then the alias moves, stamped with the decision; then the run is closed. An open decision counts where its candidate
carries the alias with its stamp: wherever a promotion was cut short, it was made, with its reason, or never asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..records import Decision, Version
from .champion_alias import crown, is_crowned, next_stamp
from .tags import DECISION_TAG, PREFIX, decision_from, decision_tags

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Run

_NUMBER_TAG, _STAMP_TAG = PREFIX + "decision_number", PREFIX + "decision_stamp"
_OF_RUN = ("candidate", "champion", "promoted", "forced", "reason", "judged_on", "judged_against", "who")


def decide(client: MlflowClient, experiment: str, decision: Decision, candidate: Version) -> None:
    """Keep a decision, and crown its candidate where it says so. One process at a time, after `settle`."""
    from mlflow.entities import Metric, Param

    stamp = next_stamp(client)
    number = max((_number(run) for run in _runs(client, experiment)), default=0) + 1
    tags = decision_tags(decision) | {_STAMP_TAG: stamp, _NUMBER_TAG: str(number)}
    verb = "promote" if decision.promoted else "refuse"
    run = client.create_run(experiment, run_name=f"{verb} {decision.candidate}", tags=tags)
    parameters = [Param(name, str(getattr(decision, name))) for name in _OF_RUN]
    metrics = [Metric(name, value, run.info.start_time, 0) for name, value in decision.figures.items()]
    client.log_batch(run.info.run_id, metrics, parameters)  # one request in place of one for each figure
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
        if candidate is not None and is_crowned(client, candidate, run.data.tags[_STAMP_TAG]):
            crown(client, candidate, run.data.tags[_STAMP_TAG])
            client.set_terminated(run.info.run_id)
        else:
            client.delete_run(run.info.run_id)


def decisions(client: MlflowClient, experiment: str, versions: Sequence[Version]) -> list[Decision]:
    """Those that count, the newest first."""
    by_label = {version.label: version for version in versions}
    decisions = []
    for run in sorted(_runs(client, experiment), key=lambda run: (_number(run), run.info.start_time), reverse=True):
        decision = decision_from(run.data.tags)
        candidate = by_label.get(decision.candidate)
        if _is_open(run) and (candidate is None or not is_crowned(client, candidate, run.data.tags[_STAMP_TAG])):
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
