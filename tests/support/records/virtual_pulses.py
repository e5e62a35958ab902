"""Pulses of the virtual bench's impacts as its force sensors record them and the ingest measures
them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pyroshock.ingest.extraction.pulses import extract_pulses
from pyroshock.twin.measured_shots import MeasuredShots
from pyroshock.twin.setting import THESIS, Setting
from pyroshock.virtualbench.campaigns.gun import ARRAY, ARRAY_SHARES
from pyroshock.virtualbench.campaigns.hammer import LOAD_CELL
from pyroshock.virtualbench.campaigns.ringing import add_pulse
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.impact.build import hammer, hand_speed, projectile, target
from pyroshock.virtualbench.impact.strike import ImpactTruth, strike_many
from pyroshock.virtualbench.sensors import SensorBuild, digitised

Floats = NDArray[np.float64]

_EFFECTS = Effects.default()
_SAMPLES, _START_S = 4096, 0.01
_THICKNESS_M, _PLATE_KG = 0.01, 8.1


def gun_shots(
    seed: int, configurations: int = 30, repetitions: int = 3
) -> tuple[MeasuredShots, Floats]:
    """Shots of the thesis's factors (Table 3.2), velocities measured to 1 %, and their true
    velocities (n,)."""
    rng = np.random.default_rng(seed)
    factors = {
        "mass": [0.2, 0.5, 1.0], "tip": ["PLA", "aluminum", "steel"], "radius": [0.03, 0.045, 0.06],
        "plate": ["aluminum", "steel"], "anvil": ["none", "aluminum", "steel"],
        "insulator": ["none", "polymeric"],
        "velocity": [4.0, 10.0, 18.0],
    }  # fmt: skip
    rows = _rows(factors, configurations, rng)
    for row in rows:
        row["velocity"] *= np.exp(0.1 * rng.standard_normal())
    settings, impactors, targets, velocity = [], [], [], []
    for row in (row for row in rows for _ in range(repetitions)):
        settings.append(_setting(row, row["mass"], row["radius"], tank_pressure_pa=1e5))
        impactors.append(projectile(row["mass"], row["tip"], row["radius"]))
        targets.append(
            target(
                row["plate"], _THICKNESS_M, anvil_material=row["anvil"], insulator=row["insulator"]
            )
        )
        velocity.append(row["velocity"] * np.exp(0.01 * rng.standard_normal()))
    truths = strike_many(impactors, targets, _EFFECTS, velocity, rng)
    forces = [truth.plate_force_n for truth in truths]
    measured = _recorded(truths, forces, 100e3, list(zip(ARRAY, ARRAY_SHARES, strict=True)), rng)
    return _shots(settings, repetitions, np.array(velocity), 0.01, measured, rng)


def hammer_shots(
    seed: int, configurations: int = 60, repetitions: int = 4
) -> tuple[MeasuredShots, Floats]:
    """Blows of the thesis's factors (Table 4.1), velocities known to 10 %, and their true
    velocities (n,)."""
    rng = np.random.default_rng(seed)
    factors = {
        "head": [("aluminum", 0.03), ("delrin", 0.03), ("polyurethane", 0.015)],
        "anvil": ["none", "aluminum", "steel"],
        "insulator": ["none", "polymeric"],
        "speed": ["low", "high"],
    }
    settings, impactors, targets, velocity = [], [], [], []
    for row in (row for row in _rows(factors, configurations, rng) for _ in range(repetitions)):
        row["tip"], radius = row["head"]
        velocity.append(hand_speed(row["speed"], _EFFECTS, rng))
        settings.append(
            _setting({**row, "plate": "aluminum"}, 0.32, radius, impact_velocity_m_s=velocity[-1])
        )
        impactors.append(hammer(row["tip"], radius))
        targets.append(
            target(
                "aluminum", _THICKNESS_M, anvil_material=row["anvil"], insulator=row["insulator"]
            )
        )
    truths = strike_many(impactors, targets, _EFFECTS, velocity, rng)
    measured = _recorded(
        truths, [truth.cell_force_n for truth in truths], 51_200.0, [(LOAD_CELL, 1.0)], rng
    )
    return _shots(settings, repetitions, np.array(velocity), 0.1, measured, rng)


def _rows(factors: dict, count: int, rng: np.random.Generator) -> list[dict]:
    """Each factor's levels equally often, in random order; an insulator needs an anvil."""
    columns = {
        name: [levels[i] for i in rng.permutation(np.arange(count) % len(levels))]
        for name, levels in factors.items()
    }
    rows = [
        dict(zip(columns, values, strict=True)) for values in zip(*columns.values(), strict=True)
    ]
    return [
        {**row, "insulator": "none" if row["anvil"] == "none" else row["insulator"]} for row in rows
    ]


def _setting(row: dict, mass_kg: float, radius_m: float, **own: float) -> Setting:
    anvil = None if row["anvil"] == "none" else THESIS[row["anvil"]]
    plate, tip = THESIS[row["plate"]], THESIS[row["tip"]]
    return Setting(
        mass_kg,
        tip,
        radius_m,
        plate,
        _THICKNESS_M,
        _PLATE_KG,
        anvil=anvil,
        insulator=row["insulator"],
        **own,
    )


def _recorded(
    truths: Sequence[ImpactTruth],
    forces: Sequence[Floats],
    rate_hz: float,
    cells: Sequence[tuple[SensorBuild, float]],
    rng: np.random.Generator,
) -> Floats:
    """Peak force, contact time and impulse (n, 3) of records that these cells and their shares of
    the force make."""
    rows = []
    for truth, force in zip(truths, forces, strict=True):
        record, start = np.zeros(_SAMPLES), _START_S + rng.uniform() / rate_hz
        for cell, share in cells:
            felt = np.zeros(_SAMPLES)
            add_pulse(felt, start, truth.time_s, share * force, cell, rate_hz, 20, _EFFECTS)
            record += (
                digitised(felt, cell, rate_hz, _EFFECTS, rng, day_fraction=rng.uniform())
                * cell.si_per_unit
            )
        (pulse,) = extract_pulses(record, rate_hz, expected=1)
        rows.append((pulse.peak_force_n, pulse.contact_time_s, pulse.impulse_n_s))
    return np.array(rows)


def _shots(
    settings: list[Setting],
    repetitions: int,
    velocity: Floats,
    relative: float,
    measured: Floats,
    rng: np.random.Generator,
) -> tuple[MeasuredShots, Floats]:
    n = len(settings)
    force, time, impulse = measured.T
    seen = velocity * np.exp(relative * rng.standard_normal(n))
    nothing = np.zeros((n, 0))
    shots = MeasuredShots(
        tuple(settings), np.arange(n) // repetitions, seen, relative * velocity, time, force,
        impulse, (), nothing,
        np.zeros(0), 10.0, np.zeros((n, 0, 0)),
    )  # fmt: skip
    return shots, velocity
