"""Registered models as a page shows them: rows of versions, versions side by side, held-out pulses
one by one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ....training.evaluation.floor import SCOPES
from ....training.evaluation.metrics import METRICS, figures, reconstruct
from ....training.registry.intact_models import damages
from ....training.registry.listing import COVERED, finite
from ...common.number_format import NOTHING, percent
from .comparing import MOST_EACH_WITH_EACH, comparisons_of
from .tables import floors_by_ground, json_row

if TYPE_CHECKING:
    from ....array_types import Floats
    from ....dataset.table import PulseTable
    from ....training.registry.evaluate import Evaluation
    from ....training.registry.records import Version
    from ....training.registry.registry import Registry

#: Gives a dataset's pulses by its hash: `model_registry.reader_of`.
Read = Callable[[str], "PulseTable"]

#: Of which intervals the coverage is told.
LEVELS = (0.50, 0.80, 0.90, 0.95)
#: Half of a 90 % interval, in spreads.
_BAND = 1.645
#: A picture holds so many points; of more pulses, as many are taken evenly.
MOST_PULSES = 2000


def version_rows(registry: Registry, versions: Sequence[Version]) -> list[dict[str, Any]]:
    """A row each, with what repetitions allow on its split, and `damaged`: what is wrong with its
    files, or None."""
    floors = floors_by_ground(registry, versions)
    wrong = damages(registry, versions)
    rows = (
        version_row(version, floors[version.dataset.hash, version.seed]) for version in versions
    )
    return [row | {"damaged": wrong.get(row["run_id"])} for row in rows]


def version_row(version: Version, floors: Mapping[str, str]) -> dict[str, Any]:
    """One version as plain data; `floors` by split, as the registry keeps them.

    `metrics` by name: `mean` over held-out pulses with its `ci90`, `floor` by scope, and the
    `thesis`'s figure; None for what there is not. `not_usable` says why it is no prediction, or
    None. `champion` says whether it is in use, `champion_of` for which predictor set.
    """
    row = json_row(version, floors)
    floor, thesis = row.get("floor") or {}, row["thesis"] or {}
    return {
        "label": version.label,
        "model": version.name,
        "version": version.version,
        "split": version.split,
        "dataset": version.dataset.name,
        "dataset_hash": version.dataset.hash,
        "predictor_set": version.dataset.predictor_set,
        "seed": version.seed,
        "seconds": finite(version.cost.seconds),
        "peak_memory_mb": finite(version.cost.peak_memory_mb),
        "created": version.registered_at.isoformat(timespec="seconds"),
        "champion": version.champion_of is not None,
        "champion_of": version.champion_of,
        "run_id": version.run_id,
        "coverage90": row["coverage90"],
        "coverage90_ci90": {name: row["ci90"].get(name) for name in COVERED},
        "force_nrmse_of_mean": row["force_nrmse_of_mean"],
        "not_usable": row["not_usable"],
        "metrics": {
            name: {
                "mean": row["metrics"][name],
                "ci90": row["ci90"][name],
                "floor": {scope: (floor.get(scope) or {}).get(name) for scope in SCOPES},
                "thesis": thesis.get(name),
            }
            for name in METRICS
        },
    }


def side_by_side(registry: Registry, versions: Sequence[Version], read: Read) -> dict[str, Any]:
    """Versions on the held-out pulses that they have in common, the smallest error of the force
    first.

    `models`: as `compare --json`, each with its `label`; `differences`: for every pair (of more
    than `MOST_EACH_WITH_EACH` versions, of the best with each other) and metric `a`, `b`,
    `difference` of their mean errors, `ci90`, `p_value`, a `verdict` in words, and `where` (the
    groups that differ beyond chance); `settings` and `promotable`: as `Comparisons.as_plain` gives
    them.
    Raises `ValueError` for fewer than two versions, and where they have no held-out pulse in
    common.
    """
    if len({version.label for version in versions}) < 2:
        raise ValueError(f"{len(versions)} versions to compare; choose two or more")
    every_pair = len(versions) <= MOST_EACH_WITH_EACH
    comparisons = comparisons_of(
        registry, versions, "force_nrmse", each_with_each=every_pair, read=read
    )
    return comparisons.as_plain()


def held_out_figures(
    registry: Registry, version: Version, read: Read, most: int = MOST_PULSES
) -> dict[str, Any]:
    """Predicted against measured on the held-out pulses of a version, and how often its intervals
    hold.

    `points` are columns of at most `most` pulses: `key`, `pulse_id`, `tip_material`,
    `configuration`, and `peak_force_n` and `contact_time_s`, each with `measured`, `predicted`, and
    `low` and `high` of the 90 % interval of a new measurement (None for a model without spread; of
    the peak, that of the force at its point). `coverage`: `level`, and the share of all held-out
    points of the `force` and of contact `time` that lie within; None without a spread. Raises
    `ValueError` where the predictions or the pulses are gone.
    """
    from ....training.registry.evaluate import evaluate_held_out

    return evaluated_figures(evaluate_held_out(registry, [version], read), version.label, most)


def evaluated_figures(judged: Evaluation, label: str, most: int = MOST_PULSES) -> dict[str, Any]:
    """`held_out_figures` of a version that is evaluated already."""
    count = len(judged.pulses)
    rows = np.unique(np.linspace(0, count - 1, min(count, most)).astype(int))
    return {
        "label": label,
        "pulses": count,
        "points": _points(judged, label, rows),
        "coverage": _coverage(judged, label),
    }


def residual_columns(judged: Evaluation, label: str) -> dict[str, Any]:
    """The relative error of the peak force of each pulse, signed, beside the factors that may
    explain it.

    `factors`: labels of the pulses by factor, as `comparison_groups` gives them but for the
    velocity.
    """
    from ....training.evaluation.comparison import comparison_groups

    pulses, prediction = judged.pulses, judged.predictions[label]
    peak = figures(reconstruct(prediction.force_n), prediction.contact_time_s).peak_force_n
    groups = comparison_groups(pulses)
    return {
        "peak_force_error": (peak / pulses.peak_force_n - 1).tolist(),
        "factors": {
            name: labels.tolist() for name, labels in groups.items() if name != "impact_velocity"
        },
        "tip_material": pulses.tip_material.tolist(),
        "impact_velocity_m_s": pulses.column("impact_velocity").tolist(),
    }


def worst_pulses(judged: Evaluation, label: str, count: int = 10) -> list[dict[str, Any]]:
    """The held-out pulses with the largest force error, the worst first; `pulse_id` is the row in
    the store."""
    pulses, prediction = judged.pulses, judged.predictions[label]
    peak = figures(reconstruct(prediction.force_n), prediction.contact_time_s).peak_force_n
    error = judged.errors[label].force_nrmse
    velocity = pulses.column("impact_velocity")
    return [
        {
            "pulse_id": int(pulses.pulse_id[row]),
            "force error (%)": float(100 * error[row]),
            "tip_material": str(pulses.tip_material[row]),
            "impact_velocity_m_s": float(velocity[row]),
            "measured_peak_force_n": float(pulses.peak_force_n[row]),
            "predicted_peak_force_n": float(peak[row]),
            "predicted over measured": float(peak[row] / pulses.peak_force_n[row]),
            "measured_contact_time_s": float(pulses.contact_time_s[row]),
            "predicted_contact_time_s": float(prediction.contact_time_s[row]),
            "campaign": str(pulses.campaign[row]),
            "run": int(pulses.run[row]),
            "repetition": int(pulses.repetition[row]),
        }
        for row in np.argsort(-error)[:count]
    ]


def compared_to(
    registry: Registry, reference: Version, others: Sequence[Version], read: Read
) -> list[dict[str, Any]]:
    """Differences of each of `others` to `reference` in every metric, on the held-out pulses that
    all have in common.

    Rows as `side_by_side` gives its `differences`. Raises `ValueError` where they have none in
    common.
    """
    from ....training.evaluation.comparison import for_all_pairs
    from ....training.registry.evaluate import compared, evaluate_held_out

    judged = evaluate_held_out(registry, [reference, *others], read)
    comparisons = for_all_pairs(
        [compared(judged, reference.label, other.label) for other in others]
    )
    return [row.row() for comparison in comparisons for row in comparison.overall]


def _points(judged: Evaluation, label: str, rows: Any) -> dict[str, Any]:
    pulses, prediction = judged.pulses, judged.predictions[label]
    force = prediction.force_n[rows]
    peak = figures(reconstruct(force), prediction.contact_time_s[rows]).peak_force_n
    spread = prediction.force_spread_n
    at_peak = (
        None
        if spread is None
        else np.take_along_axis(spread[rows], force.argmax(axis=1)[:, None], 1)[:, 0]
    )
    of_time = prediction.contact_time_spread_s
    return {
        "key": pulses.key[rows].tolist(),
        "pulse_id": pulses.pulse_id[rows].tolist(),
        "tip_material": pulses.tip_material[rows].tolist(),
        "configuration": pulses.configuration[rows].tolist(),
        "peak_force_n": _against(pulses.peak_force_n[rows], peak, at_peak),
        "contact_time_s": _against(
            pulses.contact_time_s[rows],
            prediction.contact_time_s[rows],
            None if of_time is None else of_time[rows],
        ),
    }


def _against(measured: Floats, predicted: Floats, spread: Floats | None) -> dict[str, Any]:
    low, high = (
        (None, None)
        if spread is None
        else (
            np.maximum(predicted - _BAND * spread, 0.0),
            predicted + _BAND * spread,
        )  # neither is ever negative
    )
    return {
        "measured": measured.tolist(),
        "predicted": predicted.tolist(),
        "low": None if low is None else low.tolist(),
        "high": None if high is None else high.tolist(),
    }


def _coverage(judged: Evaluation, label: str) -> dict[str, Any]:
    """By quantity the share of held-out points within their intervals, and under `..._ci90` its 90
    % interval, which counts the points of a configuration as what they are: alike."""
    from ....training.evaluation.coverage import standardised
    from ....training.evaluation.summary import clustered, share_interval

    pulses = judged.pulses
    shares: dict[str, Any] = {"level": list(LEVELS)}
    for name, words in (("force", "force"), ("time", "contact time")):
        scores = standardised(pulses, judged.predictions[label], words)
        shares[name] = shares[f"{name}_ci90"] = None
        if scores is None:
            continue
        inside = _inside(scores)
        clusters = clustered(inside, pulses.configuration)
        ends = zip(*(end.tolist() for end in share_interval(clusters)), strict=True)
        shares[name] = clusters.mean.tolist()
        shares[f"{name}_ci90"] = [list(pair) if np.isfinite(pair).all() else None for pair in ends]
    return shares


def _inside(scores: Floats) -> Floats:
    """The share of the points of each pulse within each of `LEVELS`, (n, levels); `scores` are
    errors in spreads, (n,) or (n, points)."""
    from scipy.special import ndtri

    rows = np.abs(scores.reshape(len(scores), -1))
    limits = ndtri((1 + np.array(LEVELS)) / 2)
    return np.stack([(rows <= limit).mean(axis=1) for limit in limits], axis=1)


def coverage_rows(coverage: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Nominal and held shares as rows of a table, with the intervals of the latter."""
    rows = []
    for name, words in (("force", "force points"), ("time", "contact times")):
        if coverage[name] is None:
            continue
        for level, held, ends in zip(
            coverage["level"], coverage[name], coverage[f"{name}_ci90"], strict=True
        ):
            low, high = ends or (None, None)
            rows.append(
                {
                    "quantity": words,
                    "nominal": percent(level),
                    "held": percent(held),
                    "from": NOTHING if low is None else percent(low),
                    "to": NOTHING if high is None else percent(high),
                }
            )
    return rows
