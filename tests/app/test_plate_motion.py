"""`ingest --velocity-target-motion plate`: integrated velocities with the motion of the plate's surface."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from pyroshock.schema.impacts import INTEGRATED, TARGET_MOTION_ADDED, Impact, velocity_kind
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.simulate import simulate
from sqlalchemy import select
from support.stores.stores import opened, pyroshock

ROWS = [
    {"run": str(run), "impact_position": "#1", "hammer_speed": "high", "tip_material": tip, "tip_radius_mm": radius,
     "anvil_material": "none", "insulator": "none", "boundary_conditions": "free"}
    for run, (tip, radius) in enumerate((("aluminum", "30"), ("delrin", "30")), 1)
]  # fmt: skip


@pytest.fixture(scope="module")
def campaign(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("virtual") / "hammer"
    simulate(ROWS, "hammer", folder, seed=3, effects=Effects.default(), repetitions=3, jobs=1, name="hammer")
    return folder


def velocities(campaign: Path, url: str, *words: str) -> tuple[set[str | None], np.ndarray, np.ndarray]:
    """Kinds, velocities and standard uncertainties by run and repetition."""
    result = pyroshock("ingest", campaign, "--db", url, *words)
    assert result.exit_code == 0, result.stderr
    with opened(url) as store, store.reading() as session:
        impacts = session.scalars(select(Impact).order_by(Impact.run, Impact.repetition)).all()
        figures = np.array([(impact.impact_velocity_m_s, impact.impact_velocity_u_m_s) for impact in impacts])
        return {velocity_kind(impact.velocity_source) for impact in impacts}, *figures.T


def test_velocity_is_nearer_to_the_true_one(campaign: Path, tmp_path: Path) -> None:
    """Struck bare, the plate gives way: the thesis's integral is less than six tenths of the true velocity."""
    seal = json.loads(campaign.with_name("hammer.sealed.json").read_text())
    truth = np.array([hit["velocity_m_s"] for run in seal["runs"] for hit in run["hits"]])
    kinds, integrated, _ = velocities(campaign, f"sqlite:///{tmp_path / 'thesis.db'}")
    assert kinds == {INTEGRATED}
    assert np.all(integrated < 0.6 * truth)
    plate = ("--velocity-target-motion", "plate")
    kinds, corrected, uncertainty = velocities(campaign, f"sqlite:///{tmp_path / 'plate.db'}", *plate)
    assert kinds == {TARGET_MOTION_ADDED}
    assert np.all(np.abs(corrected / truth - 1) < 0.2)
    assert np.all(np.abs(corrected - truth) < 2 * uncertainty)
