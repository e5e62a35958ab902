"""The hammer campaign (thesis, chapter 4): a person strikes a plate ten times in ten seconds, in
one recording.

The instruments of the hammer campaign (thesis, chapter 4), and two accelerometers on the plate.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from ..effects import Effects
from ..impact.build import HAND_SPEEDS_M_S, Impactor, ImpactTarget, hammer, hand_speed, target
from ..impact.strike import ImpactTruth, strike_many
from ..plate.modes import PlateModes
from ..recorder import Value
from ..sensors import SensorBuild, digitised
from .base import RecordingTask, Row, Taken, Truth, cell, cells_of, day_fraction, positive
from .ringing import (
    BOUNDARIES,
    THICKNESS_M,
    Key,
    add_pulse,
    blow,
    echoes_at,
    plate_stage,
    response_at,
    ringing_accelerations,
    settling_s,
    solved_plates,
)

# after the thesis's Dytran 5800B4; its range wide enough for the hardest blow
LOAD_CELL = SensorBuild(
    "force", "force", "N", 2e4, noise=0.2, bandwidth_hz=25e3, gain_fault=0.01, gain_drift=0.002,
    offset_drift=0.5,
    position="tip",
)  # fmt: skip
REAR = SensorBuild(  # after its B&K 8309, with the resonance of the data sheet
    "acceleration_hammer", "acceleration", "m/s2", 1e5, noise=2.0, mount_resonance_hz=180e3,
    gain_drift=0.002,
    offset_drift=1.0, position="hammer",
)  # fmt: skip
PLATE = tuple(
    SensorBuild(
        f"acceleration_{i}", "acceleration", "g", 1000.0, 9.80665, noise=0.02,
        mount_resonance_hz=45e3,
        gain_fault=0.01, zero_shift_fault=0.001, gain_drift=0.002, offset_drift=0.02,
        position="plate", axis="z",
    )
    for i in (1, 2)
)  # fmt: skip

SENSORS = (LOAD_CELL, REAR, *PLATE)


#: Thesis, chapter 4: 51.2 kHz. In a blow 20 times as fine for what the hammer feels, 8 times for
#: the plate.
RATE_HZ, RATIO, PLATE_RATIO = 51_200.0, 20, 8
#: The first hit and the time between hits (s), each give or take; never nearer than what tells one
#: swing from two.
FIRST_S, BETWEEN_S, WANDER_S, AFTER_S = 0.6, 0.95, 0.2, 0.9
RUNS_PER_DAY = 60
POSITIONS = ("#1", "#2", "#3")
PLATE_MATERIAL = "aluminum"
#: Nominal effective mass (kg), as in campaign.toml.
MASS_KG = 0.32
#: The hammer's head rings on at 7 kHz: by then it has fallen to exp(-13).
TAIL_S = 10e-3


@dataclass(frozen=True)
class HammerBench:
    """A hammer in the hand, and the plates as they are held."""

    effects: Effects
    plates: Mapping[Key, PlateModes]
    echoes: bool = False  # whether the plate's edges act on the hammer while it touches the plate
    sensors: tuple[SensorBuild, ...] = SENSORS
    sampling_rate_hz: float = RATE_HZ

    def stages(self) -> Mapping[str, Mapping[str, Value]]:
        return {"hammer": {"mass_kg": MASS_KG}, "plate": plate_stage(PLATE_MATERIAL)}

    def tasks(self, rows: Sequence[Row], repetitions: int) -> list[RecordingTask]:
        """One recording a row, and one row of runs.csv for all its hits: the ingest counts them
        on."""
        return [
            RecordingTask(
                name=f"{int(row['run']):04d}",
                row=row,
                cells=cells_of(row, 1),
                hits=repetitions,
                day_fraction=day_fraction(number, RUNS_PER_DAY),
            )
            for number, row in enumerate(rows)
        ]

    def take(self, task: RecordingTask, rng: np.random.Generator) -> Taken:
        impactor, struck = _impactor(task.row), _target(task.row)
        speeds = [
            hand_speed(cell(task.row, "hammer_speed"), self.effects, rng) for _ in range(task.hits)
        ]
        impacts = strike_many(
            [impactor] * task.hits,
            [struck] * task.hits,
            self.effects,
            speeds,
            rng,
            tail_s=TAIL_S,
            echoes=echoes_at(*self._struck_point(task.row), struck) if self.echoes else None,
        )
        starts, duration = moments(task.hits, rng)
        samples = round(duration * RATE_HZ)
        signals = [
            *self._at_hammer(impacts, starts, samples),
            *self._at_plate(task.row, impacts, starts, samples),
        ]
        channels = {
            sensor.name: digitised(
                signal, sensor, RATE_HZ, self.effects, rng, day_fraction=task.day_fraction
            )
            for sensor, signal in zip(self.sensors, signals, strict=True)
        }
        return Taken(channels, [_truth(*hit) for hit in zip(starts, impacts, strict=True)])

    def _struck_point(self, row: Row) -> tuple[PlateModes, int]:
        return self.plates[_plate(row)], POSITIONS.index(cell(row, "impact_position", POSITIONS))

    def _at_hammer(
        self, impacts: Sequence[ImpactTruth], starts: Sequence[float], samples: int
    ) -> list[Floats]:
        """Band-limited force and acceleration of the hammer, SI, each (samples,)."""
        force, rear = np.zeros(samples), np.zeros(samples)
        for impact, start in zip(impacts, starts, strict=True):
            for out, signal, sensor in (
                (force, impact.cell_force_n, LOAD_CELL),
                (rear, impact.impactor_acceleration_m_s2, REAR),
            ):
                add_pulse(out, start, impact.time_s, signal, sensor, RATE_HZ, RATIO, self.effects)
        return [force, rear]

    def _at_plate(
        self, row: Row, impacts: Sequence[ImpactTruth], starts: Sequence[float], samples: int
    ) -> Sequence[Floats]:
        """Band-limited accelerations of the plate, SI, each (samples,)."""
        plate, point = self._struck_point(row)
        settle = settling_s(PLATE, self.effects)
        blows = [
            blow(start, impact.time_s, impact.plate_force_n, RATE_HZ, PLATE_RATIO, settle)
            for start, impact in zip(starts, impacts, strict=True)
        ]
        response, shape = response_at(plate, point), plate.shape_impact[point]
        return list(
            ringing_accelerations(
                blows, samples, plate, shape, response, PLATE, RATE_HZ, self.effects
            )
        )


def set_up(
    rows: Sequence[Row], effects: Effects, rng: np.random.Generator, *, echoes: bool = False
) -> HammerBench:
    """The bench for a plan of hammer runs, every row checked. Raises `ValueError` naming run,
    column and value."""
    for row in rows:
        _impactor(row), _target(row)
        cell(row, "impact_position", POSITIONS)
        cell(row, "hammer_speed", tuple(HAND_SPEEDS_M_S))
    return HammerBench(effects, solved_plates((_plate(row) for row in rows), effects, rng), echoes)


def moments(hits: int, rng: np.random.Generator) -> tuple[list[float], float]:
    """When a person strikes (s, rising), and how long the recording is: about ten seconds for ten
    hits."""
    wander = rng.uniform(-WANDER_S, WANDER_S, hits)
    starts = FIRST_S + BETWEEN_S * np.arange(hits) + wander
    return [float(start) for start in starts], FIRST_S + BETWEEN_S * (hits - 1) + AFTER_S


def _plate(row: Row) -> Key:
    return PLATE_MATERIAL, BOUNDARIES[cell(row, "boundary_conditions", tuple(BOUNDARIES))]


def _impactor(row: Row) -> Impactor:
    return hammer(cell(row, "tip_material"), positive(row, "tip_radius_mm") * 1e-3, mass_kg=MASS_KG)


def _target(row: Row) -> ImpactTarget:
    anvil, insulator = cell(row, "anvil_material"), cell(row, "insulator")
    return target(PLATE_MATERIAL, THICKNESS_M, anvil_material=anvil, insulator=insulator)


def _truth(start_s: float, impact: ImpactTruth) -> Truth:
    return {
        "start_s": start_s,
        "velocity_m_s": impact.velocity_m_s,
        "mass_kg": impact.mass_kg,
        "contact_time_s": impact.contact_time_s,
        "restitution": impact.restitution,
        "peak_force_n": impact.peak_force_n,
        "contacts": impact.contacts,
        "impulse_n_s": float(np.trapezoid(impact.force_n, impact.time_s)),
    }
