"""Stores that reports are written of: a gun's plan that is half worked off, and a registry of two
models."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pyroshock.app.operations.plan.planning import make_plan
from pyroshock.dataset.table import PulseTable
from pyroshock.doe.plans import discard_run, read_plan
from pyroshock.schema.session import Store
from pyroshock.training.fitting.session import train
from pyroshock.training.registry.promotion import promote
from pyroshock.training.registry.registry import Registry

from support.records.campaigns import gun_campaign, write_runs
from support.records.pulse_tables import pulse_table
from support.stores.registries import (
    context_in,
    fresh_registry,
    without_figures,
    without_judging_the_first,
)
from support.stores.stores import ingested, opened

RUNS, FIRED, REPETITIONS = 6, 4, 2
#: Achieved over planned: of the tank's pressure as written down, of the velocity.
FILLED, FAST = 1.02, 1.1

#: A registry, and what gives a dataset's pulses by its hash.
ModelLab = tuple[Registry, Callable[[str], PulseTable]]


def planned_store(folder: Path) -> str:
    """A gun plan of six runs of which four were fired, with one discarded; the address of the
    store."""
    url = f"sqlite:///{folder / 'lab.db'}"
    with opened(url, create=True) as store:
        make_plan(store, "lhs", "spring", runs=RUNS, repetitions=REPETITIONS, seed=1)
        discard_run(store, "spring", RUNS, "the anvil <b>broke</b>")
        rows = _rows_of_plan(store)
    campaign = gun_campaign(folder / "spring", name="spring")
    write_runs(campaign, rows)
    ingested(url, campaign)
    return url


def _rows_of_plan(store: Store) -> list[dict[str, object]]:
    """The first runs of the plan as a lab fires them."""
    with store.reading() as session:
        plan = read_plan(session, "spring")
    speeds, rows = {"low": 7.0, "medium": 14.0, "high": 22.0}, []
    for run in plan.runs[:FIRED]:
        settings = {key: level for key, level in run.row.items() if key != "velocity_level"}
        settings["tank_pressure_bar"] = str(FILLED * run.settings["tank_pressure_bar"])
        speed = FAST * speeds[run.row["velocity_level"]]
        for repetition in range(1, REPETITIONS + 1):
            rows.append(
                {
                    "run": run.run,
                    "repetition": repetition,
                    **settings,
                    "measured_velocity_m_s": speed,
                }
            )
    return rows


def model_lab(folder: Path) -> ModelLab:
    """A law and a statistical model, each judged on both splits; both were promoted, the
    statistical one is in use."""
    registry = fresh_registry(folder)
    table = pulse_table(np.random.default_rng(1), repetitions=3)
    with pytest.MonkeyPatch.context() as patch:
        without_figures(patch)
        without_judging_the_first(patch)
        train(
            registry,
            context_in(registry, table),
            ["hann", "linear"],
            ["repetitions", "configurations"],
        )
        promote(registry, "hann", 1, lambda _: table, forced=True, reason="to begin with")
    promote(registry, "linear", 1, lambda _: table, forced=True, reason="to <i>try</i> it")
    return registry, lambda _: table
