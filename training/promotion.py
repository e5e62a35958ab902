"""Which model is in use, and why: the gate of every change of champion."""

from __future__ import annotations

import getpass
import socket
from collections.abc import Callable
from datetime import UTC, datetime

from ..dataset.table import PulseTable
from .comparison import Comparison, compare
from .judging import Judged, on_held_out, on_other
from .listing import chosen
from .metrics.errors import METRICS
from .records import Decision, Version
from .registry.registry import Registry
from .tasks import rng_of

#: The gate's metric: eq. 5.4 sees time and force together.
GATE = "cost"


def promote(
    registry: Registry,
    name: str,
    version: int,
    read: Callable[[str], PulseTable],
    *,
    other: tuple[str, PulseTable] | None = None,
    forced: bool = False,
    reason: str = "",
) -> Decision:
    """Make a version the champion of its predictor set, or refuse to: when its mean cost is greater than the present
    champion's on held-out pulses that neither was trained on, or on the `other` (name, pulses) of a campaign.

    Either way the decision is kept, with its figures. `forced` promotes the worse one too, for the `reason` given.
    Raises `LookupError` for a version there is not, `ValueError` for one whose files are damaged, where there is
    nothing to compare on, or where `forced` has no reason.
    """
    if forced and not reason.strip():
        raise ValueError("a forced promotion needs its reason: --reason TEXT")
    with registry.promoting():
        registry.settle()
        candidate = chosen(registry.versions(), f"{name}@{version}")
        _refuse_damaged(registry, candidate)
        champion = registry.champion(candidate.dataset.predictor_set)
        if champion is None or champion.label == candidate.label:
            what = "no model was in use" if champion is None else "it was in use already"
            decision = _decision(candidate, champion, True, forced, _joined(reason, what), "nothing", 0, {})
        else:
            decision = _judged(registry, candidate, champion, read, other, forced, reason)
        registry.decide(decision, candidate)
    return decision


def _judged(
    registry: Registry,
    candidate: Version,
    champion: Version,
    read: Callable[[str], PulseTable],
    other: tuple[str, PulseTable] | None,
    forced: bool,
    reason: str,
) -> Decision:
    both = [candidate, champion]
    kinds = [version.dataset.velocity_kind for version in both]
    if other and None not in kinds and kinds[0] != kinds[1]:
        taken = " and ".join(f"{version.label} velocities {version.dataset.velocity_kind}" for version in both)
        raise ValueError(
            f"{taken}: one of them would be asked with the other's; judge them on held-out pulses, without --on"
        )
    try:
        judged = on_other(registry, both, other[1]) if other else on_held_out(registry, both, read)
    except ValueError as error:
        if not forced:
            raise
        why = _joined(reason, f"nothing to compare on ({error})")
        return _decision(candidate, champion, True, forced, why, "nothing", 0, {})
    where = other[0] if other else f"held-out pulses ({candidate.split})"
    comparison = compared(judged, candidate.label, champion.label)
    gate = comparison.of(GATE)
    worse = gate.difference > 0
    why = _joined(reason, gate.verdict)
    figures = {f"{metric}.difference": comparison.of(metric).difference for metric in METRICS}
    figures |= {"cost.candidate": gate.mean_a, "cost.champion": gate.mean_b, "cost.p_value": gate.p_value}
    return _decision(candidate, champion, forced or not worse, forced, why, where, len(judged.pulses), figures)


def _refuse_damaged(registry: Registry, candidate: Version) -> None:
    wrong = registry.damage(candidate)
    if wrong is not None:
        raise ValueError(f"{candidate.label} cannot be promoted, predictions would fail: {wrong}")


def compared(judged: Judged, a: str, b: str, groups: bool = False) -> Comparison:
    """Two of the judged models beside each other; the draws depend on who is compared, so the same is said again."""
    from .groups import comparison_groups

    pulses = judged.pulses
    named = comparison_groups(pulses) if groups else {}
    rng = rng_of("compare", pulses.key[0], "-".join(sorted((a, b))), len(pulses))
    return compare(judged.errors[a], judged.errors[b], pulses.configuration, named, rng, names=(a, b))


def _decision(
    candidate: Version,
    champion: Version | None,
    promoted: bool,
    forced: bool,
    reason: str,
    judged_on: str,
    pulses: int,
    figures: dict[str, float],
) -> Decision:
    return Decision(
        candidate=candidate.label,
        champion=champion.label if champion else None,
        predictor_set=candidate.dataset.predictor_set,
        promoted=promoted,
        forced=forced,
        reason=reason,
        judged_on=judged_on,
        pulses=pulses,
        figures=figures,
        who=_who(),
        when=datetime.now(UTC),
    )


def _joined(*parts: str) -> str:
    return "; ".join(part.strip() for part in parts if part.strip())


def _who() -> str:
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a container's user without a name
        user = "unknown"
    return f"{user}@{socket.gethostname()}"
