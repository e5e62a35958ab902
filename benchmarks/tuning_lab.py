"""The lab of the tuning benchmark: its history on the virtual bench, and the twin that it makes of it.

The lab knows its drawing (outline, thickness, where it strikes and measures), its gun's drawing and what it has
measured: no damping, no friction, nothing of the seal.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from pyroshock.app.tune.bench_adapter import SensorTwin
from pyroshock.app.twins.building import TwinRequest, twin_of
from pyroshock.app.twins.measured_shots import CampaignPlate, read_measured_shots
from pyroshock.dataset.rows import stored_materials
from pyroshock.schema.session import Store, Writer, open_store
from pyroshock.twin.chain import Twin
from pyroshock.twin.plate.build import PlateBuild, named_points
from pyroshock.twin.plate.modes import cached_plate
from pyroshock.twin.plate.stage import PlateStage
from pyroshock.twin.setting import THESIS
from pyroshock.twin.tune.goal import level_db
from pyroshock.twin.tune.tuner import FiredShots
from pyroshock.virtualbench.plate.build import OUTLINE_M

from .measuring import ROOT
from .tuning_bench import LINES_HZ, SENSOR

#: As on the lab's drawing; the same places that `virtualbench.plate.resonant` has.
IMPACTS_M = {"#1": (0.47, 0.28), "#2": (0.31, 0.37), "#3": (0.68, 0.22)}
SENSORS_M = {"acceleration_1": (0.22, 0.20), "acceleration_2": (0.73, 0.37)}
THICKNESS_M, MAX_MODE_HZ = 0.010, 20e3
PLATES = ("aluminum", "steel")
RUNS, NAME, MODEL = 105, "lab", "coregional-gp"

_POSITION = """[[factors]]
name = "impact_position"
kind = "categorical"
levels = ["#1", "#2", "#3"]
change = 1

"""


@dataclass(frozen=True, eq=False)
class Lab:
    """Its twin at the sensor, and the spectra of its history."""

    forward: SensorTwin
    history: FiredShots
    plate_masses_kg: dict[str, float]


def history(folder: Path, seed: int) -> str:
    """Plan, shoot, ingest, train and promote in `folder`, each step once; returns the store's URL."""
    folder.mkdir(parents=True, exist_ok=True)
    factors = folder / "factors.toml"
    shipped = (ROOT / "doe" / "data" / "gun.toml").read_text(encoding="utf-8")
    factors.write_text(shipped.replace("[[requires]]", _POSITION + "[[requires]]", 1), encoding="utf-8")
    runs = ("--runs", str(RUNS), "--repetitions", "1", "--seed", str(seed), "--factors", str(factors))
    steps = (
        ("init",),
        ("plan", "lhs", NAME, *runs),
        ("simulate", NAME, "--out", str(folder / NAME), "--seed", str(seed), "--jobs", "2"),
        ("ingest", str(folder / NAME)),
        ("dataset", "build", NAME, "--from", NAME, "--split", "configurations"),
        ("train", NAME, "--models", MODEL, "--split", "configurations"),
        ("promote", MODEL, "1"),
    )
    for step in steps:
        _once(folder, step)
    return _url(folder)


def _once(folder: Path, step: tuple[str, ...]) -> None:
    """A command of ours, unless it was done before; what it says is kept beside the mark."""
    mark = folder / f"{'-'.join(step[:2] if step[0] in ('plan', 'dataset') else step[:1])}.done"
    if mark.exists():
        return
    environment = {**os.environ, "PYROSHOCK_DB": _url(folder)}
    command = [sys.executable, "-c", "from pyroshock.app.cli.main import main; main()", *step]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(step)}: {done.stderr.strip()[-2000:]}")
    mark.write_text(done.stderr, encoding="utf-8")


def _url(folder: Path) -> str:
    return f"sqlite:///{(folder / 'lab.db').resolve()}"


def lab(folder: Path, seed: int, contact: str | None = None) -> Lab:
    """After its history. `contact`: a law in place of the registered model."""
    url = history(folder, seed)
    with open_store(url, Writer("benchmarks.tuning", "0")) as store:
        forward = SensorTwin(_twin(store, url, folder, contact), SENSOR)
        return Lab(forward, _measured(store), {name: _build(name).mass_kg for name in PLATES})


def _twin(store: Store, url: str, folder: Path, contact: str | None) -> Twin:
    """As `app.twins` makes it, with both plates and the drawing's places."""
    request = TwinRequest(
        campaign=NAME,
        contact=contact,
        impact_points=tuple(IMPACTS_M.values()),
        sensors=tuple(SENSORS_M.values()),
        frequency_hz=tuple(LINES_HZ.tolist()),
    )
    built = twin_of(store, url, request)
    plates = {name: cached_plate(_build(name), MAX_MODE_HZ, folder / "plates") for name in PLATES}
    return replace(built.twin, calibration=None, plate=PlateStage(plates, label="finite elements"))


def _build(material: str) -> PlateBuild:
    return PlateBuild(OUTLINE_M, THICKNESS_M, THESIS[material], named_points(IMPACTS_M), named_points(SENSORS_M))


def _measured(store: Store) -> FiredShots:
    plate = CampaignPlate(PLATES[0], THICKNESS_M, _build(PLATES[0]).area_m2)
    with store.reading() as session:
        known = stored_materials(session)
        shots, left_out = read_measured_shots(
            session, NAME, frequency_hz=LINES_HZ, q=10.0, sensors=(SENSOR,), plate=plate,
            material=lambda name: known[name.lower()],
        )  # fmt: skip
    shots = shots.take(np.flatnonzero(np.isfinite(shots.spectra_m_s2).all(axis=(1, 2))))
    sys.stderr.write(f"history: {len(shots)} shots, left out {len(left_out)}\n")
    return FiredShots(shots.settings, level_db(shots.spectra_m_s2[:, 0]))
