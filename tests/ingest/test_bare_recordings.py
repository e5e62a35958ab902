"""A campaign whose recordings say neither names nor rate, from folder to stored pulses."""

from __future__ import annotations

import sqlite3
from contextlib import closing

import numpy as np
import pytest
from scipy.io import savemat, wavfile
from support.stores.stores import ingested

RATE_HZ = 10_000.0
TOML = """\
[campaign]
name = "bare"
kind = "hammer"
date = 2026-11-24
[bench.hammer]
mass_kg = 0.3
[recordings]
columns = ["force", "acceleration_1"]
sampling_rate_hz = 10000
[channels.force]
quantity = "force"
unit = "N"
[channels.acceleration_1]
quantity = "acceleration"
unit = "m/s2"
"""


def _hit() -> np.ndarray:
    """Force and acceleration of a half-sine of 1500 N and 2 ms, with noise: (600, 2)."""
    phase = np.clip((np.arange(600) / RATE_HZ - 0.02) / 2e-3, 0, 1)
    force = 1500 * np.sin(np.pi * phase) + 0.2 * np.random.default_rng(7).normal(size=600)
    return np.column_stack([force, -2 * force + 3 * np.random.default_rng(8).normal(size=600)])


WRITERS = {
    "hit.txt": lambda path, table: np.savetxt(path, table, "%12.4f"),
    "hit.lvm": lambda path, table: np.savetxt(path, table, "%.6f", "\t"),
    "hit.npy": np.save,
    "hit.mat": lambda path, table: savemat(path, {"data": table}),
    "hit.wav": lambda path, table: wavfile.write(path, int(RATE_HZ), table),
}


@pytest.mark.parametrize("name", WRITERS)
def test_names_and_rate_of_campaign_toml_reach_the_store(tmp_path, name):
    folder = tmp_path / "bare"
    folder.mkdir()
    (folder / "campaign.toml").write_text(TOML, encoding="utf-8")
    (folder / "runs.csv").write_text(f"run,repetition,recording\n1,1,{name}\n", encoding="utf-8")
    WRITERS[name](folder / name, _hit())
    ingested(f"sqlite:///{tmp_path / 'lab.db'}", folder)
    with closing(sqlite3.connect(tmp_path / "lab.db")) as store:
        channels = store.execute("select name, sampling_rate_hz from channels").fetchall()
        assert sorted(channels) == [("acceleration_1", RATE_HZ), ("force", RATE_HZ)]
        ((peak,),) = store.execute("select peak_force_n from pulses").fetchall()
        assert peak == pytest.approx(1500, rel=1e-3)
