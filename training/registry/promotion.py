"""Which model is in use, and why: the gate of every change of champion."""

from __future__ import annotations

import getpass
import socket
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime

import numpy as np

from ...dataset.table import PulseTable
from ...parallel.task import one_thread
from ..evaluation.gate import (
    UPDATED_LAW,
    GateVerdict,
    Verdict,
    coverage_figures,
    judge,
    too_few,
)
from ..evaluation.metrics import METRICS
from ..evaluation.unseen_configurations import (
    PulseDraws,
    prior_draws,
    unseen_draws,
    unseen_scores,
    updated_law_draws,
)
from ..evaluation.unseen_scores import UnseenScores
from ..models.training_task import rng_of
from .evaluate import compared, evaluate_held_out, evaluate_on_table
from .listing import chosen
from .records import Decision, Version
from .registry import Registry
from .usability import usability

Read = Callable[[str], PulseTable]


def promote(
    registry: Registry,
    name: str,
    version: int,
    read: Read,
    *,
    other: tuple[str, PulseTable] | None = None,
    forced: bool = False,
    reason: str = "",
    who: str | None = None,
) -> Decision:
    """Make a version the champion of its predictor set where the gate of `evaluation.gate` lets it
    pass, or refuse to.

    On unseen configurations its 90 % bands must hold, and it must predict peak force, contact time
    and impulse better than the present champion, beyond chance. A first champion must predict them
    better than what answers without a model: the contact law updated by the pulses that the
    candidate learned from.

    They are judged by the mean CRPS of peak force, contact time and impulse
    (`unseen_configurations`): models and law learn anew, without the configurations that they
    predict, and a model's bands are calibrated without these. Either way the decision is kept, with
    its `verdict` and figures.

    Parameters:
        registry: Where the version is registered, and the decision is kept.
        name: The name of the model, such as "hybrid".
        version: The number of the version.
        read: Gives the pulses of a dataset by its hash.
        other: Name and pulses of another dataset or of a campaign, on which the candidate and what
            it is compared with are judged; by default they are judged on the dataset that the
            candidate learned from.
        forced: Whether a version that does not pass is promoted, too; by default False. The
            decision then says what failed.
        reason: Why somebody wants the version promoted; it is kept with the decision. A forced
            promotion needs it; else it may be empty, which is the default.
        who: The person who decides; by default (None) the login of this process and its machine.

    Returns:
        The decision as it is kept.

    Raises:
        LookupError: For a version there is not.
        ValueError: For a version whose files are damaged, where there is nothing to judge on, and
            for a forced promotion without a reason.
    """
    if forced and not reason.strip():
        raise ValueError("a forced promotion needs its reason: --reason TEXT")
    with registry.promoting():
        registry.settle()
        candidate = chosen(registry.versions(), f"{name}@{version}")
        if wrong := registry.damage(candidate):
            raise ValueError(
                f"{candidate.label} cannot be promoted, predictions would fail: {wrong}"
            )
        champion = registry.champion(candidate.dataset.predictor_set)
        if champion is not None and champion.label == candidate.label:
            why = _joined(reason, "it was in use already")
            decision = _decision(candidate, champion, True, forced, why, "promoted")
        else:
            decision = _decide_promotion(registry, candidate, champion, read, other, forced, reason)
        if who is not None:
            decision = replace(decision, who=who)
        registry.decide(decision, candidate)
    return decision


def _decide_promotion(
    registry: Registry,
    candidate: Version,
    champion: Version | None,
    read: Read,
    other: tuple[str, PulseTable] | None,
    forced: bool,
    reason: str,
) -> Decision:
    if wrong := _not_usable(registry, candidate):
        why = (
            _joined(reason, f"promoted by force although {wrong}")
            if forced
            else _joined(wrong, _given(reason))
        )
        return _decision(
            candidate, champion, forced, forced, why, "forced" if forced else "not usable"
        )
    try:
        pulses = other[1] if other else read(candidate.dataset.hash)
        if few := too_few(len(np.unique(pulses.configuration))):
            why = (
                _joined(reason, f"promoted by force although {few}")
                if forced
                else _joined(few, _given(reason))
            )
            return _decision(
                candidate,
                champion,
                forced,
                forced,
                why,
                "forced" if forced else "not enough to judge",
            )
        scores = _scores(registry, candidate, champion, read, pulses)
    except (ValueError, LookupError) as error:
        if not forced:
            raise ValueError(
                f"{candidate.label} cannot be judged on unseen configurations: {error}"
            ) from error
        why = _joined(reason, f"it could not be judged on unseen configurations ({error})")
        return _decision(candidate, champion, True, forced, why, "forced")
    where = f"unseen configurations of {other[0] if other else candidate.dataset.name}"
    rng = rng_of("promote", candidate.dataset.hash, candidate.label, candidate.seed)
    p_value = scores.p_value(rng)
    judgement = judge(scores, p_value)
    figures = {**scores.figures(), **coverage_figures(scores), "crps.p_value": p_value}
    why = _reason(judgement, forced, reason)
    figures |= _pulse_errors(registry, candidate, champion, read, other)
    verdict: Verdict = "forced" if forced and not judgement.promoted else judgement.verdict
    decision = _decision(candidate, champion, forced or judgement.promoted, forced, why, verdict)
    pulses_judged = len(scores.configuration)
    return replace(
        decision,
        judged_on=where,
        judged_against=scores.names[1],
        pulses=pulses_judged,
        figures=figures,
    )


def _not_usable(registry: Registry, candidate: Version) -> str:
    """Why the candidate is no prediction; empty where it is one."""
    records = [version for version in registry.versions() if version.label == candidate.label]
    return usability(records, registry.floors(candidate.dataset.hash, candidate.seed))


def _reason(judgement: GateVerdict, forced: bool, given: str) -> str:
    """The judgement and the reason that was `given`, of which the one that decided comes first."""
    if judgement.promoted:
        return _joined(given, judgement.reason)
    if forced:
        return _joined(given, f"promoted by force although {judgement.reason}")
    return _joined(judgement.reason, _given(given))


def _given(reason: str) -> str:
    return f"the reason given was: {reason.strip()}" if reason.strip() else ""


def _scores(
    registry: Registry, candidate: Version, champion: Version | None, read: Read, pulses: PulseTable
) -> UnseenScores:
    predictions = {candidate.label: _draws(registry, candidate, read)}
    if champion is None:
        kind = candidate.dataset.velocity_kind
        law = updated_law_draws(_learned(registry, candidate, read), pulses, kind)
        predictions |= {
            UPDATED_LAW: law,
            "the contact law before any shot": prior_draws(pulses, kind),
        }
    else:
        predictions |= {champion.label: _draws(registry, champion, read)}
    folds_rng = rng_of("folds", candidate.dataset.hash, "configurations", candidate.seed)
    # Matrices are small: threads that wait for each other take three times the time of one.
    with one_thread():
        return unseen_scores(pulses, predictions, folds_rng)


def _draws(registry: Registry, version: Version, read: Read) -> PulseDraws:
    """Of a registered model, refitted."""
    learned = _learned(registry, version, read)
    return unseen_draws(registry.load(version).model, learned, version.dataset.velocity_kind)


def _learned(registry: Registry, version: Version, read: Read) -> PulseTable:
    """The pulses that a registered model was trained on."""
    table = read(version.dataset.hash)
    return table.take(np.isin(table.key, registry.held_out(version).trained_on))


def _pulse_errors(
    registry: Registry,
    candidate: Version,
    champion: Version | None,
    read: Read,
    other: tuple[str, PulseTable] | None,
) -> dict[str, float]:
    """Further information: mean errors of the models as they are registered, on pulses that neither
    was trained on.

    Empty without a champion, and where there are no such pulses.
    """
    if champion is None:
        return {}
    both = [candidate, champion]
    kinds = [version.dataset.velocity_kind for version in both]
    if other and None not in kinds and kinds[0] != kinds[1]:
        taken = " and ".join(
            f"{version.label} velocities {version.dataset.velocity_kind}" for version in both
        )
        raise ValueError(
            f"{taken}: one of them would be asked with the other's; judge "
            f"them on held-out pulses, without --on"
        )
    try:
        judged = (
            evaluate_on_table(registry, both, other[1])
            if other
            else evaluate_held_out(registry, both, read)
        )
    except ValueError:
        return {}
    comparison = compared(judged, candidate.label, champion.label)
    cost = comparison.of("cost")
    figures = {f"{metric}.difference": comparison.of(metric).difference for metric in METRICS}
    return figures | {
        "cost.candidate": cost.mean_a,
        "cost.champion": cost.mean_b,
        "cost.p_value": cost.p_value,
    }


def _decision(
    candidate: Version,
    champion: Version | None,
    promoted: bool,
    forced: bool,
    reason: str,
    verdict: Verdict,
) -> Decision:
    """One that nothing was judged for."""
    return Decision(
        candidate=candidate.label,
        champion=champion.label if champion else None,
        predictor_set=candidate.dataset.predictor_set,
        promoted=promoted,
        forced=forced,
        reason=reason,
        judged_on="nothing",
        judged_against="nothing",
        pulses=0,
        figures={},
        who=_user_and_host(),
        when=datetime.now(UTC),
        verdict=verdict,
    )


def _joined(*parts: str) -> str:
    return "; ".join(part.strip() for part in parts if part.strip())


def _user_and_host() -> str:
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a container's user without a name
        user = "unknown"
    return f"{user}@{socket.gethostname()}"
