"""A registered model as a report: its figures by split beside what can be had, how it errs, what was decided of it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ...training.evaluation.floor import SCOPES
from ...training.evaluation.metrics import METRICS
from ...training.evaluation.plot_style import LABELS
from ...training.evaluation.summary import Estimate
from ...training.registry.listing import newest
from ...training.registry.records import Decision, Version
from ..models.tables import json_row
from .document import Cell, Document, Section, Table
from .model_figures import pulses_section

if TYPE_CHECKING:
    from ...dataset.table import PulseTable
    from ...training.registry.registry import Registry

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
