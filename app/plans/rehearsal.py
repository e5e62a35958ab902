"""A campaign before the first real one: planned, played on the virtual bench, ingested, and held against its plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...doe.plans import UnknownPlanError, read_plan
from ...ingest.load import ingest_folder
from ...ingest.plan_link import link_campaign
from ...schema.listings import iter_shots
from ...schema.session import Store
from ...virtualbench.effects import Effects
from ...virtualbench.simulate import simulate
from ..predictions.nominal import with_predictions
from .planning import make_plan
from .simulation import rows_of

NAME, RUNS, REPETITIONS, SEED = "rehearsal", 10, 1, 1

Progress = Callable[[int, int, str], None]


@dataclass(frozen=True)
class RehearsalResult:
    """What came of it: counts, and how far the measured velocities lie from the nominal gun's."""

    planned: int
    done: int
    shots: int
    findings: int
    median_ratio: float  # measured over predicted velocity
    spread: float  # standard deviation of the ratio

    def as_row(self) -> dict[str, Any]:
        return vars(self).copy()


def rehearse(store: Store, folder: Path, progress: Progress | None = None) -> RehearsalResult:
    """Plan, simulate and ingest a small gun campaign; what is there already is not made again."""
    _plan(store)
    if not (folder / "campaign.toml").is_file():
        kind, rows, repetitions = rows_of(store, NAME)
        effects = Effects.default()
        simulate(rows, kind, folder, seed=SEED, effects=effects, repetitions=repetitions, progress=progress, name=NAME)
    report = ingest_folder(store, folder)
    link_campaign(store, NAME, NAME)
    with store.reading() as session:
        runs = read_plan(session, NAME).runs
        shots = list(with_predictions(session, iter_shots(session, NAME)))
    ratios = np.array(
        [s["measured_velocity_m_s"] / s["predicted_velocity_m_s"] for s in shots if s["measured_velocity_m_s"]]
    )
    return RehearsalResult(
        planned=len(runs),
        done=sum(run.status == "done" for run in runs),
        shots=len(shots),
        findings=len(report.findings),
        median_ratio=float(np.median(ratios)),
        spread=float(np.std(ratios)),
    )


def _plan(store: Store) -> None:
    with store.reading() as session:
        try:
            read_plan(session, NAME)
            return
        except UnknownPlanError:
            pass
    make_plan(store, "lhs", NAME, runs=RUNS, repetitions=REPETITIONS, seed=SEED)
