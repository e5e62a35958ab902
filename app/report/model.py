"""A registered model as a report: its figures by split beside what can be had, how it errs on the pulses held out and
what its bands cover, what was decided of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ...array_types import Floats
from ...training.evaluation.floor import SCOPES
from ...training.evaluation.metrics import METRICS, figures, reconstruct
from ...training.evaluation.plot_style import LABELS
from ...training.evaluation.summary import Estimate
from ...training.registry.listing import newest
from ...training.registry.records import Decision, Version
from ..documents.document import Block, Cell, ChartRow, Document, Figure, Paragraph, Section, Table, force_unit
from ..documents.svg import MOST_POINTS, Cloud, Curve, agreement_chart, dot_keys, line_chart, line_keys
from ..train.tables import json_row

if TYPE_CHECKING:
    from ...dataset.table import PulseTable
    from ...training.models.base import ContactPrediction
    from ...training.registry.registry import Registry


def pulses_section(registry: Registry, version: Version, read: Callable[[str], PulseTable]) -> Section:
    """The charts; in their place the reason where the store has not the pulses, or the registry not the predictions."""
    from ...training.registry.evaluate import evaluate_held_out

    title = "On the pulses held out"
    try:
        judged = evaluate_held_out(registry, [version], read)
    except (LookupError, ValueError) as error:
        return Section(title, [Paragraph(f"Not drawn: {error}", quiet=True)])
    pulses, prediction = judged.pulses, judged.predictions[version.label]
    caption = f"{len(pulses)} pulses that it was not trained on; dashed: 10 % off."
    if len(pulses) > MOST_POINTS:
        caption += f" {MOST_POINTS} of them are drawn."
    blocks: list[Block] = [
        Paragraph(caption, quiet=True),
        agreement(pulses, prediction),
        *_coverage(pulses, prediction),
    ]
    return Section(title, blocks)


def agreement(pulses: PulseTable, prediction: ContactPrediction) -> ChartRow:
    """Predicted against measured peak force and contact time, logarithmic: what counts is relative."""
    peak = figures(reconstruct(prediction.force_n), prediction.contact_time_s).peak_force_n
    unit, per_newton = force_unit(float(pulses.peak_force_n.max()))
    force = _clouds(pulses, per_newton * pulses.peak_force_n, per_newton * peak)
    time = _clouds(pulses, 1e3 * pulses.contact_time_s, 1e3 * prediction.contact_time_s)
    charts = (("peak force", unit, force), ("contact time", "ms", time))
    drawn = [
        Figure(
            f"Predicted against measured {name}",
            agreement_chart(
                f"predicted against measured {name}",
                clouds,
                f"measured ({unit})",
                f"predicted ({unit})",
                logarithmic=True,
                off=0.1,
            ),
        )
        for name, unit, clouds in charts
    ]
    return ChartRow(drawn, dot_keys(force))


def _clouds(pulses: PulseTable, measured: Floats, predicted: Floats) -> list[Cloud]:
    names = [
        f"{c} run {r}, repetition {k}" for c, r, k in zip(pulses.campaign, pulses.run, pulses.repetition, strict=True)
    ]
    clouds = []
    for number, tip in enumerate(np.unique(pulses.tip_material).tolist()):
        rows = np.flatnonzero(pulses.tip_material == tip)
        clouds.append(Cloud(f"{tip} tip", measured[rows], predicted[rows], [names[i] for i in rows], number))
    return clouds


def _coverage(pulses: PulseTable, prediction: ContactPrediction) -> list[Block]:
    """How many measurements central intervals hold, beside how many they promise to."""
    from ...training.evaluation.plots import LEVELS, coverage

    pairs = (
        ("force", prediction.force_n - pulses.force_n, prediction.force_spread_n),
        ("contact time", prediction.contact_time_s - pulses.contact_time_s, prediction.contact_time_spread_s),
    )
    curves = [
        Curve(name, LEVELS, coverage(_scores(off, spread)), number)
        for number, (name, off, spread) in enumerate(pairs)
        if spread is not None
    ]
    if not curves:
        return [Paragraph("The model gives no spread: it has no intervals to cover anything.", quiet=True)]
    drawing = line_chart("promised and found coverage", curves, "promised coverage", "found coverage", diagonal=True)
    at_90 = ", ".join(f"{c.name} {float(c.y[LEVELS == 0.9][0]):.3f}" for c in curves)
    return [ChartRow([Figure(f"Coverage of intervals; at 0.90: {at_90}", drawing, line_keys(curves))])]


def _scores(off: Floats, spread: Floats) -> Floats:
    """Errors in spreads; where a law is certain any error is beyond all of its intervals."""
    return np.divide(off, spread, out=np.where(off == 0, 0.0, np.inf), where=spread > 0)


_COVERED = {"force_covered": "force points within the 90 % band", "time_covered": "contact times within it"}


def model_document(registry: Registry, version: Version, read: Callable[[str], PulseTable]) -> Document:
    """The report on a version; `read` gives a dataset's pulses by its hash, and may raise `LookupError`."""
    siblings = of_all_splits(registry.versions(), version)
    floors = registry.floors(version.dataset.hash, version.seed)
    in_use = f"the model in use for a {version.champion_of}" if version.champion_of else "not in use"
    splits = ", ".join(f"{version.split} ({version.label})" for version in siblings)
    return Document(
        kind="Model",
        title=version.label,
        lead=f"Trained on {version.dataset.name}, judged on held-out {version.split}; {in_use}.",
        facts={
            "Dataset": f"{version.dataset.name}, of a {version.dataset.predictor_set}",
            "Dataset hash": version.dataset.hash,
            "Split": version.split,
            "Seed": str(version.seed),
            "Registered": f"{version.registered_at:%Y-%m-%d %H:%M} UTC",
            "Cost": _cost(version),
            "Files (SHA-256)": version.sha256,
            "Figures of": splits,
        },
        sections=(
            Section("Figures by split", [_figures(version, floors) for version in siblings]),
            pulses_section(registry, version, read),
            Section("Promotions", [_promotions(registry.decisions(), siblings)]),
        ),
        date=version.registered_at.date(),
    )


def of_all_splits(versions: Sequence[Version], version: Version) -> list[Version]:
    """`version` first, then the newest of the same model, dataset and seed on each other split."""
    same = (version.name, version.dataset.hash, version.seed)
    others = newest(version for version in versions if (version.name, version.dataset.hash, version.seed) == same)
    by_split = {version.split: version for version in sorted(others, key=lambda each: each.version)}
    by_split.pop(version.split, None)
    return [version, *(by_split[split] for split in sorted(by_split))]


def _cost(version: Version) -> str:
    return f"{version.cost.seconds:.1f} s to train, {version.cost.peak_memory_mb:.0f} MB at most"


def _figures(version: Version, floors: Mapping[str, str]) -> Table:
    row = json_row(version, floors)
    floor, thesis = row.get("floor") or {}, row["thesis"] or {}
    rows: list[list[Cell]] = []
    for metric in METRICS:
        allowed = [(floor.get(scope) or {}).get(metric) for scope in SCOPES]
        rows.append([LABELS[metric], *_interval(version.metrics[metric]), *allowed, thesis.get(metric)])
    for metric, name in _COVERED.items():
        if metric in version.metrics:
            rows.append([f"{name} (share)", *_interval(version.metrics[metric]), None, None, None])
    heads = ("figure", "mean", "90 % interval", *(f"floor by {scope}" for scope in SCOPES), "thesis")
    return Table(
        f"{version.label} on held-out {version.split}: means over pulses; the floor is what repetitions allow.",
        heads,
        rows,
    )


def _interval(estimate: Estimate) -> list[Any]:
    between = f"{estimate.low:.4g} to {estimate.high:.4g}" if math.isfinite(estimate.low + estimate.high) else None
    return [estimate.mean, between]


def _promotions(decisions: Sequence[Decision], versions: Sequence[Version]) -> Table:
    """Decisions that a version was part of, the newest first."""
    labels = {version.label for version in versions}
    rows: list[list[Cell]] = [
        [
            f"{decision.when:%Y-%m-%d %H:%M}",
            decision.candidate,
            decision.champion,
            ("forced" if decision.forced else "promoted") if decision.promoted else "refused",
            decision.judged_on,
            decision.judged_against,
            decision.pulses,
            decision.reason,
            decision.who,
        ]
        for decision in decisions
        if {decision.candidate, decision.champion} & labels
    ]
    heads = (
        *("when (UTC)", "candidate", "in use before", "decision"),
        *("judged on", "judged against", "pulses", "reason", "who"),
    )
    return Table("Promotions and refusals that it was part of.", heads, rows, "It was neither promoted nor refused.")
