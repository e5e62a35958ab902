"""The gun campaign (thesis, chapters 2, 3 and 5): one recording a shot, triggered by the pressure drop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...array_types import Floats
from ..effects import Effects
from ..gun.build import GunBuild, Projectile
from ..gun.channels import Trigger, shot_signals
from ..gun.fire import fire
from ..gun.truth import ShotTruth
from ..gun.valve import ValveWay
from ..impact.strike import ImpactTruth, strike_many
from ..plate.modes import PlateModes
from ..recorder import Value
from ..sensors import SensorBuild, analog, digitised
from ..sensors.faults import gain, offset_si
from .base import RecordingTask, Row, Taken, cells_of, day_fraction, positive
from .gun_rows import POSITIONS, chain_height_of, impactor_of, plate_of, point_of, target_of, truth_of, valve_way_of
from .gun_sensors import ARRAY, ARRAY_SHARES, LASER, PLATE, SENSORS, TANK
from .plates import Key, echoes_at, plate_stage, response_at, solved_plates
from .ringing import felt
from .windows import add_pulse, blow, settling_s

#: Thesis, section 2.2.2: 100 kHz. Finer by these factors for pressure and laser, for the load cells and for the plate.
RATE_HZ, SLOW_RATIO, RATIO, PLATE_RATIO = 100_000.0, 4, 20, 8
DURATION_S = 1.2
#: From the valve's first turn to the trigger at most, at strength 1 of gun.valve_flow.
TRIGGER_S = 0.3
#: By how much (s, standard deviation) the trigger comes early or late at strength 1 of bench.trigger_jitter.
JITTER_S = 1e-3
#: How much earlier (s, of the order of) a hand begins a recording that nothing triggers.
HAND_S = 0.05
#: What the operator leaves of a deviation when setting the pressure (relative, bench.hand_scatter at strength 1).
SETTING_SPREAD = 0.003
#: The lab's bullets are 85 mm long (thesis, section 3.1) and measured to half a millimetre; the true length is that
#: over 1 + strength of sensor.velocity_gain times this.
BULLET_LENGTH_M, BULLET_LENGTH_U_M, VELOCITY_FAULT = 0.085, 0.5e-3, 0.005
RUNS_PER_DAY = 20
TAIL_S = 4e-3


@dataclass(frozen=True)
class VirtualGunBench:
    """The gun, and the suspended plates in front of it."""

    effects: Effects
    plates: Mapping[Key, PlateModes]
    echoes: bool = False  # whether the plate's edges act on the bullet while it touches the plate
    gun: GunBuild = field(default_factory=GunBuild)
    sensors: tuple[SensorBuild, ...] = SENSORS
    sampling_rate_hz: float = RATE_HZ
    trigger: Trigger = field(default_factory=Trigger)
    heights_m: tuple[float, ...] = (0.0,)  # at which the plates' impact points were taken

    def stages(self) -> Mapping[str, Mapping[str, Value]]:
        """With two materials of plate in a plan, [bench.plate] has the first one's; the rows of runs.csv say which."""
        nominal = {
            "tank_volume_m3": self.gun.tank_volume_m3,
            "bore_diameter_m": self.gun.bore_diameter_m,
            "projectile_diameter_m": Projectile().diameter_m,
            "travel_m": self.gun.vent_position_m,
            "friction_coefficient": self.gun.friction_coefficient,
            "heat_capacity_ratio": 1.4,
            "efficiency": 1.0,
        }
        return {"gun": nominal, "plate": plate_stage(next(iter(self.plates))[0])}

    def tasks(self, rows: Sequence[Row], repetitions: int) -> list[RecordingTask]:
        """One recording, and one row of runs.csv, for each shot."""
        bullet = {
            "bullet_length_mm": f"{BULLET_LENGTH_M * 1e3:g}",
            "bullet_length_u_mm": f"{BULLET_LENGTH_U_M * 1e3:g}",
        }
        return [
            RecordingTask(
                name=f"{int(row['run']):04d}-{repetition:02d}",
                row=row,
                cells={**cells_of(row, repetition), **bullet},
                hits=1,
                day_fraction=day_fraction(number, RUNS_PER_DAY),
            )
            for number, row in enumerate(rows)
            for repetition in range(1, repetitions + 1)
        ]

    def take(self, task: RecordingTask, rng: np.random.Generator) -> Taken:
        length = BULLET_LENGTH_M / (1 + VELOCITY_FAULT * self.effects["sensor.velocity_gain"])
        bullet = Projectile(positive(task.row, "bullet_mass_kg"), length)
        valve_mode, pressure_pa = valve_way_of(task.row), self._pressure(task, rng)
        until_s = self._until_s(valve_mode)
        shot = fire(self.gun, self.effects, pressure_pa, bullet, rng, until_s=until_s, valve_way=valve_mode)
        moment = float(rng.standard_normal())
        late = -HAND_S * abs(moment)
        if self.trigger.share is not None:
            late = JITTER_S * self.effects["bench.trigger_jitter"] * moment
        origin = -self.trigger.begin_s(shot) - late
        impact = self._impact(task.row, shot, rng)
        start = origin + shot.impact_time_s
        signals = self._slow(shot, bullet, late) | self._fast(task.row, impact, start)
        channels = {
            sensor.name: digitised(
                signals[sensor.name], sensor, RATE_HZ, self.effects, rng, day_fraction=task.day_fraction
            )
            for sensor in self.sensors
        }
        return Taken(channels, [truth_of(shot, impact, origin, start, length)])

    def _until_s(self, way: ValveWay | None) -> float:
        """How long a shot is followed: the recording, and what the valve takes before the trigger."""
        slowest_s = TRIGGER_S if way is None else max(TRIGGER_S, 1.2 * way.moments_s[-1])
        return DURATION_S - self.trigger.pre_trigger_s + slowest_s * max(1.0, self.effects["gun.valve_flow"])

    def _pressure(self, task: RecordingTask, rng: np.random.Generator) -> float:
        """The true pressure (Pa, gauge): the operator sets the plan's by the transducer, with its errors."""
        read = positive(task.row, "tank_pressure_bar") * 1e5
        read *= 1 + SETTING_SPREAD * self.effects["bench.hand_scatter"] * float(rng.standard_normal())
        true = (read - offset_si(TANK, self.effects, task.day_fraction)) / gain(TANK, self.effects, task.day_fraction)
        return max(0.0, true)

    def _impact(self, row: Row, shot: ShotTruth, rng: np.random.Generator) -> ImpactTruth | None:
        """None where the bullet does not get as far as the plate."""
        if not shot.impact_velocity_m_s > 0:
            return None
        struck, plate = target_of(row), self.plates[plate_of(row)]
        echoes = echoes_at(plate, self._point(row), struck) if self.echoes else None
        return strike_many(
            [impactor_of(row)], [struck], self.effects, [shot.impact_velocity_m_s], rng, tail_s=TAIL_S, echoes=echoes
        )[0]

    def _point(self, row: Row) -> int:
        """Where a row's bullet strikes, among the plate's points at all heights of its chains."""
        return point_of(row) + len(POSITIONS) * self.heights_m.index(chain_height_of(row))

    def _slow(self, shot: ShotTruth, bullet: Projectile, late_s: float) -> dict[str, Floats]:
        """Band-limited tank pressure and laser, SI (samples,)."""
        rate = RATE_HZ * SLOW_RATIO
        signals = shot_signals(shot, bullet, rate, DURATION_S, self.trigger, trigger_offset_s=late_s)
        time = np.arange(round(DURATION_S * rate)) / rate
        pairs = ((TANK, signals["tank_pressure"]), (LASER, signals["laser"]))
        return {sensor.name: analog(time, signal, sensor, RATE_HZ, self.effects) for sensor, signal in pairs}

    def _fast(self, row: Row, impact: ImpactTruth | None, start_s: float) -> dict[str, Floats]:
        """Band-limited forces of the array and accelerations of the plate, SI (samples,)."""
        samples = round(DURATION_S * RATE_HZ)
        out = {sensor.name: np.zeros(samples) for sensor in (*ARRAY, *PLATE)}
        if impact is None:
            return out
        for sensor, share in zip(ARRAY, ARRAY_SHARES, strict=True):
            pulse = share * impact.plate_force_n
            add_pulse(out[sensor.name], start_s, impact.time_s, pulse, sensor, RATE_HZ, RATIO, self.effects)
        plate, point = self.plates[plate_of(row)], self._point(row)
        blows = [
            blow(start_s, impact.time_s, impact.plate_force_n, RATE_HZ, PLATE_RATIO, settling_s(PLATE, self.effects))
        ]
        shape, response = plate.shape_impact[point], response_at(plate, point)
        accelerations = felt(blows, samples, plate, shape, response, PLATE, RATE_HZ, self.effects)
        return out | {sensor.name: row for sensor, row in zip(PLATE, accelerations, strict=True)}


def set_up(rows: Sequence[Row], effects: Effects, rng: np.random.Generator, *, echoes: bool = False) -> VirtualGunBench:
    """The bench for a plan of shots, every row checked. Raises `ValueError` naming run, column and value."""
    for row in rows:
        impactor_of(row), target_of(row), point_of(row), positive(row, "tank_pressure_bar"), valve_way_of(row)
    heights = tuple(dict.fromkeys((0.0, *map(chain_height_of, rows))))
    plates = solved_plates((plate_of(row) for row in rows), effects, rng, heights)
    return VirtualGunBench(effects, plates, heights_m=heights, echoes=echoes)
