"""`python -m benchmarks.prediction_coverage FOLDER [--seeds 1 2 3] [--kind gun]`: whether 90 % bands hold 90 %.

Campaigns of the virtual bench at default strengths, guns of 30 configurations x 3 and hammers of 60 x 4, are simulated
and ingested into FOLDER where they are not there yet. A third of the configurations is held out. The twin predicts
them (a) with nothing learned, (b) with 10 shots of 10 other configurations, (c) with all shots of the other two thirds,
and is compared with what was recorded of them: hammers are asked with the true velocity of the sealed file. Each row
gives the share of values within the 90 % band, the median absolute error and the CRPS, in ln or (spectrum) dB.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pyroshock.app.cli.common import open_if_exists
from pyroshock.app.twins.building import BuiltTwin, TwinRequest, twin_of
from pyroshock.app.twins.learning import calibrated, taught_contact
from pyroshock.app.twins.measured_shots import read_measured_shots, struck_plate
from pyroshock.training.evaluation.summary import ensemble_crps
from pyroshock.twin.gun.stage import GunStage
from pyroshock.twin.measured_shots import MeasuredShots
from pyroshock.twin.prediction import Prediction

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

SIZES = {"gun": (30, 3), "hammer": (60, 4)}
STATES = ("a: nothing", "b: 10 shots", "c: two thirds")
FEW_SHOTS, HELD_OUT, DRAWS = 10, 1 / 3, 64
DECIBELS = 20 / np.log(10)
QUANTITIES = ("velocity", "contact time", "peak force", "impulse", "peak acceleration", "spectrum")


@dataclass(frozen=True, eq=False)
class Scored:
    """Of the values of one quantity, (n,): measured less the median, whether within the band, and CRPS."""

    error: Floats
    inside: Floats
    crps: Floats


def made_campaign(folder: Path, kind: str, seed: int) -> tuple[str, str, Path]:
    """Name, store and seal of a campaign, simulated and ingested where it is not there."""
    name = f"{kind}-{seed}"
    db, seal = f"sqlite:///{folder / f'{name}.db'}", folder / f"{name}.sealed.json"
    if not (folder / f"{name}.db").exists():
        runs, repetitions = (str(number) for number in SIZES[kind])
        command = [sys.executable, "-m", "pyroshock"]
        plan = ["plan", "lhs", name, "--runs", runs, "--kind", kind, "--repetitions", repetitions, "--seed", str(seed)]
        for step in (plan, ["simulate", name, "--out", str(folder / name), "--seed", str(seed)]):
            subprocess.run([*command, *step, "--db", db], check=True, capture_output=True)
        subprocess.run([*command, "ingest", str(folder / name), "--db", db], check=True, capture_output=True)
    return name, db, seal


def scores_of_campaign(folder: Path, campaign: tuple[str, int]) -> list[tuple[str, int, str, str, Scored]]:
    """(kind, seed, state, quantity, scores) of one campaign."""
    kind, seed = campaign
    name, db, seal = made_campaign(folder, kind, seed)
    with open_if_exists(db) as store:
        built = twin_of(store, db, TwinRequest(campaign=name, learn=False))
        assert store is not None
        with store.reading() as session:
            shots, _ = read_measured_shots(
                session,
                name,
                frequency_hz=built.twin.frequency_hz,
                q=built.twin.q,
                sensors=built.twin.sensor_names,
                material=built.material,
                plate=struck_plate(built.bench),
            )
        plates = {
            material: twin_of(store, db, TwinRequest(campaign=name, plate=material, learn=False))
            for material in {setting.plate.name for setting in shots.settings}
        }
    rng = np.random.default_rng(1000 + seed)
    configurations = rng.permutation(np.unique(shots.configuration))
    held_out = configurations[: round(HELD_OUT * len(configurations))]
    rest = shots.without(held_out)
    few = rest.take(_first_shots(rest, rng)[:FEW_SHOTS])
    asked = shots.take(np.flatnonzero(np.isin(shots.configuration, held_out)))
    if kind == "hammer":
        rows = np.flatnonzero(np.isin(shots.configuration, held_out))
        asked = _with_true_velocity(asked, rows, shots, seal)
    rows_of_scores = []
    for state, learned in zip(STATES, (rest.take([]), few, rest), strict=True):
        twins = {material: learned_twin(plate, plates, learned) for material, plate in plates.items()}
        rows_of_scores += [
            (kind, seed, state, quantity, scored) for quantity, scored in _scored(twins, asked, kind).items()
        ]
    return rows_of_scores


def learned_twin(built: BuiltTwin, plates: dict[str, BuiltTwin], shots: MeasuredShots) -> BuiltTwin:
    """The twin after these shots."""
    if not len(shots):
        return built
    gun = built.twin.gun and _taught_gun(built.twin.gun, shots)
    twin = replace(built.twin, contact=taught_contact(built.twin.contact, shots), gun=gun)
    others = {name: plate.twin.plate.plates[name] for name, plate in plates.items()}
    return replace(built, twin=calibrated(twin, shots, others.__getitem__)[0])


def _taught_gun(gun: GunStage, shots: MeasuredShots) -> GunStage:
    measured = shots.take(np.flatnonzero(shots.impact_velocity_m_s > 0))
    pressure = np.array([setting.tank_pressure_pa or 0.0 for setting in measured.settings])
    mass = np.array([setting.impactor_mass_kg for setting in measured.settings])
    return gun.updated(pressure, mass, measured.impact_velocity_m_s, measured.impact_velocity_u_m_s)


def _first_shots(shots: MeasuredShots, rng: np.random.Generator) -> Rows:
    """The first shot of each configuration with a measured force, in a random order."""
    usable = np.flatnonzero(np.isfinite(shots.peak_force_n))
    first = usable[np.unique(shots.configuration[usable], return_index=True)[1]]
    return rng.permutation(first)


def _with_true_velocity(asked: MeasuredShots, rows: Rows, shots: MeasuredShots, seal: Path) -> MeasuredShots:
    """Settings with the velocities of the seal, whose hits stand in the order of runs and of time as the shots do."""
    runs = sorted(json.loads(seal.read_text())["runs"], key=lambda run: (run["run"], run["repetition"]))
    hits = [hit for run in runs for hit in run["hits"]]
    if len(hits) != len(shots):
        raise ValueError(f"{len(hits)} hits in the seal, {len(shots)} in the store: they cannot be matched")
    true = [float(hits[row]["velocity_m_s"]) for row in rows]
    return replace(
        asked,
        settings=tuple(replace(s, impact_velocity_m_s=v) for s, v in zip(asked.settings, true, strict=True)),
    )


def _scored(twins: dict[str, BuiltTwin], asked: MeasuredShots, kind: str) -> dict[str, Scored]:
    parts: dict[str, list[Scored]] = {name: [] for name in QUANTITIES}
    for row in range(len(asked)):
        setting = asked.settings[row]
        if not asked.impact_velocity_m_s[row] > 0:
            continue  # the bullet stayed in the barrel: what the sensors then show is no impact
        try:
            prediction = twins[setting.plate.name].twin.predict(setting, draws=DRAWS, rng=np.random.default_rng(row))
        except ValueError as error:
            if "barrel" not in str(error):
                raise
            continue  # the bullet is said to stay in the barrel: there is nothing to compare
        for name, draws, measured in _compared(prediction, asked, row, kind):
            usable = np.isfinite(measured) & (measured > 0) & (draws > 0).all(axis=0)
            if usable.any():
                unit = DECIBELS if name == "spectrum" else 1.0
                parts[name].append(_score(unit * np.log(draws[:, usable]), unit * np.log(measured[usable])))
    return {
        name: Scored(
            *(np.concatenate([getattr(part, field) for part in some]) for field in ("error", "inside", "crps"))
        )
        for name, some in parts.items()
        if some
    }


def _compared(
    prediction: Prediction, asked: MeasuredShots, row: int, kind: str
) -> Iterator[tuple[str, Floats, Floats]]:
    """Quantity, draws (d, k) and measured values (k,)."""
    draws, single = prediction.draws, np.atleast_1d
    count = len(draws.peak_force_n)
    if kind == "gun":
        yield "velocity", draws.velocity_m_s[:, None], single(asked.impact_velocity_m_s[row])
    yield "contact time", draws.contact_time_s[:, None], single(asked.contact_time_s[row])
    yield "peak force", draws.peak_force_n[:, None], single(asked.peak_force_n[row])
    yield "impulse", draws.impulse_n_s[:, None], single(asked.impulse_n_s[row])
    yield "peak acceleration", draws.peak_acceleration_m_s2, asked.peak_acceleration_m_s2[row]
    yield "spectrum", draws.spectra_m_s2.reshape(count, -1), asked.spectra_m_s2[row].ravel()


def _score(draws: Floats, measured: Floats) -> Scored:
    low, median, high = np.quantile(draws, (0.05, 0.5, 0.95), axis=0, method="hazen")
    inside = ((measured >= low) & (measured <= high)).astype(np.float64)
    return Scored(measured - median, inside, ensemble_crps(draws, measured))


def main(arguments: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3])
    parser.add_argument("--kind", choices=tuple(SIZES), action="append")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args(arguments)
    campaigns = [(kind, seed) for kind in options.kind or SIZES for seed in options.seeds]
    with get_context("spawn").Pool(options.jobs) as pool:
        rows = [row for part in pool.imap(partial(scores_of_campaign, options.folder), campaigns) for row in part]
    print(f"{'kind':7s} {'learned':14s} {'quantity':18s} {'values':>6s}  coverage of 90 % (per seed)     |error|  CRPS")
    for kind, state, quantity in dict.fromkeys((row[0], row[2], row[3]) for row in rows):
        parts = [row[4] for row in rows if (row[0], row[2], row[3]) == (kind, state, quantity)]
        error, inside, crps = (np.concatenate([getattr(p, f) for p in parts]) for f in ("error", "inside", "crps"))
        each = " ".join(f"{part.inside.mean():.2f}" for part in parts)
        print(
            f"{kind:7s} {state:14s} {quantity:18s} {len(error):6d}  {inside.mean():.3f} ({each})"
            f"{'':6s} {np.median(np.abs(error)):.3f}  {crps.mean():.4f}  bias {error.mean():+.3f}"
        )


if __name__ == "__main__":
    main()
