"""The gun campaign (thesis, chapters 2, 3 and 5): one recording a shot, triggered by the pressure
drop.

A row of a gun's plan as the bench plays it, and what is sealed of its shot.

The instruments at the gun (thesis, section 2.2.1).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from ...array_types import Floats
from ..effects import Effects
from ..gun.build import GunBuild, Projectile
from ..gun.fire import LASER_REST_M, ShotTruth, Trigger, fire, shot_signals
from ..gun.gas import ValveWay
from ..impact.build import Impactor, ImpactTarget, projectile, target
from ..impact.strike import ImpactTruth, strike_many
from ..plate.build import IMPACT_POINTS_M, OUTLINE_M
from ..plate.modes import PlateModes
from ..recorder import Value
from ..sensors import SensorBuild, analog, digitised
from ..sensors.filters import gain, offset_si
from .base import RecordingTask, Row, Taken, Truth, cell, cells_of, day_fraction, positive
from .ringing import (
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

#: Where the bullet can hit: the frame moves sideways in front of the gun. The first is the default.
POSITIONS = ("#1", "#2", "#3")
#: Of the chains on which the plate hangs (thesis, section 2.1.1).
CHAIN_PITCH_MM = 56.0


def plate_of(row: Row) -> Key:
    return cell(row, "plate_material"), "free"


def point_of(row: Row) -> int:
    """The plate's impact point in the optional column `impact_position`; the first without one."""
    return (
        POSITIONS.index(cell(row, "impact_position", POSITIONS))
        if row.get("impact_position")
        else 0
    )


def valve_way_of(row: Row) -> ValveWay | None:
    """The optional column `valve_profile`: "0:0 0.1:1", points of time (s) and the ball's position;
    None without one.

    Raises `ValueError` naming the run.
    """
    text = (row.get("valve_profile") or "").strip()
    if not text:
        return None
    try:
        points = [tuple(map(float, point.split(":"))) for point in text.replace(",", " ").split()]
        moments, positions = zip(*points, strict=True)
        return ValveWay(moments, positions)
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"plan: run {row.get('run', '?')}: valve_profile is {text!r}; expected points "
            "TIME:POSITION in s and 0 (shut) to 1 (open), such as '0:0 0.1:1'"
        ) from error


def chain_height_of(row: Row) -> float:
    """The optional column `chain_height_mm`, in m: by which the plate hangs higher, in links of 56
    mm; 0 without one.

    Raises `ValueError` naming the run, also for a plate so high or low that the bullet misses it.
    """
    text = (row.get("chain_height_mm") or "0").strip()
    try:
        links = float(text) / CHAIN_PITCH_MM
    except ValueError:
        links = math.inf
    if not (math.isfinite(links) and abs(links - round(links)) < 1e-6):
        raise ValueError(
            f"plan: run {row.get('run', '?')}: chain_height_mm is {text!r}; "
            f"expected a multiple of {CHAIN_PITCH_MM:g}"
        )
    height = links * CHAIN_PITCH_MM * 1e-3
    x, y = IMPACT_POINTS_M[point_of(row)]
    corners = zip(OUTLINE_M, (*OUTLINE_M[1:], OUTLINE_M[0]), strict=True)
    if any((x1 - x0) * (y - height - y0) < (y1 - y0) * (x - x0) for (x0, y0), (x1, y1) in corners):
        raise ValueError(
            f"plan: run {row.get('run', '?')}: chain_height_mm is {text!r}: "
            f"the bullet misses the plate"
        )
    return height


def impactor_of(row: Row) -> Impactor:
    radius = positive(row, "tip_radius_mm") * 1e-3
    return projectile(positive(row, "bullet_mass_kg"), cell(row, "tip_material"), radius)


def target_of(row: Row) -> ImpactTarget:
    anvil, insulator = cell(row, "anvil_material"), cell(row, "insulator")
    return target(
        cell(row, "plate_material"), THICKNESS_M, anvil_material=anvil, insulator=insulator
    )


def truth_of(
    shot: ShotTruth, impact: ImpactTruth | None, origin_s: float, start_s: float, length_m: float
) -> Truth:
    """Of a shot whose valve begins to turn at `origin_s` of the recording, and whose impact is at
    `start_s`."""
    truth: Truth = {
        "tank_pressure_pa": float(shot.tank_pressure_pa[0]),
        "muzzle_velocity_m_s": shot.muzzle_velocity_m_s,
        "bullet_length_m": length_m,
        "exit_time_s": shot.exit_time_s if math.isfinite(shot.exit_time_s) else None,
        "valve_opens_s": origin_s + shot.port_opens_s if math.isfinite(shot.port_opens_s) else None,
        "velocity_m_s": shot.impact_velocity_m_s,
    }
    if impact is None:
        return truth
    return truth | {
        "start_s": start_s,
        "mass_kg": impact.mass_kg,
        "contact_time_s": impact.contact_time_s,
        "restitution": impact.restitution,
        "peak_force_n": impact.peak_force_n,
        "peak_plate_force_n": float(impact.plate_force_n.max()),
        "contacts": impact.contacts,
        "impulse_n_s": float(np.trapezoid(impact.force_n, impact.time_s)),
    }


#: GENSPEC GS 4002 with the thesis's calibration; 16 bits over ±10 V.
TANK = SensorBuild(
    "tank_pressure", "pressure", "bar", 16.0, 1e5, bits=16, sensitivity=0.5621, offset_v=0.3624,
    noise=0.002,
    bandwidth_hz=1e3, gain_fault=0.005, offset_fault=0.005, gain_drift=0.001, offset_drift=0.002,
)  # fmt: skip
#: Panasonic LM10 ANR1215: 130 ± 50 mm over ±5 V, 20 µm; the electronics' corner is assumed.
LASER = SensorBuild(
    "laser", "displacement", "mm", 180.0, 1e-3, bits=16, sensitivity=0.1, offset_v=-13.0,
    noise=0.02, bandwidth_hz=10e3,
    offset_drift=0.05, position="muzzle",
)  # fmt: skip
#: PCB 350B43, its axis normal to the plate; in-plane axes have no model here and are not recorded.
PLATE = tuple(
    SensorBuild(
        f"acceleration_{i}", "acceleration", "g", 10_000.0, 9.80665, noise=0.5,
        mount_resonance_hz=45e3,
        gain_fault=0.01, zero_shift_fault=0.001, gain_drift=0.002, offset_drift=0.1,
        position="plate", axis="z",
    )
    for i in (1, 2)
)  # fmt: skip
#: Four Kistler 9107C, of whose 700 kN a fifth is preload.
ARRAY = tuple(
    SensorBuild(
        f"force_{i}", "force", "kN", 560.0, 1e3, noise=0.005, bandwidth_hz=25e3, gain_fault=0.01,
        gain_drift=0.002,
        offset_drift=0.01, position=f"cell {i}",
    )
    for i in (1, 2, 3, 4)
)  # fmt: skip
#: The blow does not fall on the centre of the array: what share each cell carries.
ARRAY_SHARES = (0.27, 0.24, 0.26, 0.23)

SENSORS = (TANK, LASER, *PLATE, *ARRAY)


#: Thesis, section 2.2.2: 100 kHz. Finer by these factors for pressure and laser, for the load cells
#: and for the plate.
RATE_HZ, SLOW_RATIO, RATIO, PLATE_RATIO = 100_000.0, 4, 20, 8
DURATION_S = 1.2
#: Samples after which the laser's electronics, at 10 kHz, and the anti-alias filter are at rest: by
#: then they have fallen to exp(-50).
SETTLED = 250
#: From the valve's first turn to the trigger at most, at strength 1 of gun.valve_flow.
TRIGGER_S = 0.3
#: By how much (s, standard deviation) the trigger comes early or late at strength 1 of
#: bench.trigger_jitter.
JITTER_S = 1e-3
#: How much earlier (s, of the order of) a hand begins a recording that nothing triggers.
HAND_S = 0.05
#: What the operator leaves of a deviation when setting the pressure (relative, bench.hand_scatter
#: at strength 1).
SETTING_SPREAD = 0.003
#: The lab's bullets are 85 mm long (thesis, section 3.1) and measured to half a millimetre; the
#: true length is that over 1 + strength of sensor.velocity_gain times this.
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
        """With two materials of plate in a plan, [bench.plate] has the first one's; the rows of
        runs.csv say which."""
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
        valve_way, pressure_pa = valve_way_of(task.row), self._pressure(task, rng)
        until_s = self._until_s(valve_way)
        shot = fire(
            self.gun, self.effects, pressure_pa, bullet, rng, until_s=until_s, valve_way=valve_way
        )
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
                signals[sensor.name],
                sensor,
                RATE_HZ,
                self.effects,
                rng,
                day_fraction=task.day_fraction,
            )
            for sensor in self.sensors
        }
        return Taken(channels, [truth_of(shot, impact, origin, start, length)])

    def _until_s(self, valve_way: ValveWay | None) -> float:
        """How long a shot is followed: the recording, and what the valve takes before the
        trigger."""
        slowest_s = (
            TRIGGER_S if valve_way is None else max(TRIGGER_S, 1.2 * valve_way.moments_s[-1])
        )
        return (
            DURATION_S
            - self.trigger.pre_trigger_s
            + slowest_s * max(1.0, self.effects["gun.valve_flow"])
        )

    def _pressure(self, task: RecordingTask, rng: np.random.Generator) -> float:
        """The true pressure (Pa, gauge): the operator sets the plan's by the transducer, with its
        errors."""
        read = positive(task.row, "tank_pressure_bar") * 1e5
        read *= 1 + SETTING_SPREAD * self.effects["bench.hand_scatter"] * float(
            rng.standard_normal()
        )
        true = (read - offset_si(TANK, self.effects, task.day_fraction)) / gain(
            TANK, self.effects, task.day_fraction
        )
        return max(0.0, true)

    def _impact(self, row: Row, shot: ShotTruth, rng: np.random.Generator) -> ImpactTruth | None:
        """None where the bullet does not get as far as the plate."""
        if not shot.impact_velocity_m_s > 0:
            return None
        struck, plate = target_of(row), self.plates[plate_of(row)]
        echoes = echoes_at(plate, self._point(row), struck) if self.echoes else None
        return strike_many(
            [impactor_of(row)],
            [struck],
            self.effects,
            [shot.impact_velocity_m_s],
            rng,
            tail_s=TAIL_S,
            echoes=echoes,
        )[0]

    def _point(self, row: Row) -> int:
        """Where a row's bullet strikes, among the plate's points at all heights of its chains."""
        return point_of(row) + len(POSITIONS) * self.heights_m.index(chain_height_of(row))

    def _slow(self, shot: ShotTruth, bullet: Projectile, late_s: float) -> dict[str, Floats]:
        """Band-limited tank pressure and laser, SI (samples,)."""
        rate = RATE_HZ * SLOW_RATIO
        signals = shot_signals(
            shot, bullet, rate, DURATION_S, self.trigger, trigger_offset_s=late_s
        )
        time = np.arange(round(DURATION_S * rate)) / rate
        tank = analog(time, signals["tank_pressure"], TANK, RATE_HZ, self.effects)
        laser = np.full(tank.size, LASER_REST_M)
        for stretch in _where_it_moves(signals["laser"], LASER_REST_M):
            fine = slice(SLOW_RATIO * stretch.start, SLOW_RATIO * stretch.stop)
            laser[stretch] = analog(
                time[fine], signals["laser"][fine], LASER, RATE_HZ, self.effects
            )
        return {TANK.name: tank, LASER.name: laser}

    def _fast(self, row: Row, impact: ImpactTruth | None, start_s: float) -> dict[str, Floats]:
        """Band-limited forces of the array and accelerations of the plate, SI (samples,)."""
        samples = round(DURATION_S * RATE_HZ)
        out = {sensor.name: np.zeros(samples) for sensor in (*ARRAY, *PLATE)}
        if impact is None:
            return out
        felt = np.zeros(samples)  # the four load cells are alike
        add_pulse(
            felt,
            start_s,
            impact.time_s,
            impact.plate_force_n,
            ARRAY[0],
            RATE_HZ,
            RATIO,
            self.effects,
        )
        for sensor, share in zip(ARRAY, ARRAY_SHARES, strict=True):
            out[sensor.name] = share * felt
        plate, point = self.plates[plate_of(row)], self._point(row)
        settle = settling_s(PLATE, self.effects)
        hit = blow(start_s, impact.time_s, impact.plate_force_n, RATE_HZ, PLATE_RATIO, settle)
        shape, response = plate.shape_impact[point], response_at(plate, point)
        accelerations = ringing_accelerations(
            [hit], samples, plate, shape, response, PLATE, RATE_HZ, self.effects
        )
        return out | {sensor.name: row for sensor, row in zip(PLATE, accelerations, strict=True)}


def _where_it_moves(signal: Floats, rest: float) -> Iterator[slice]:
    """Stretches of the recording in which a fine signal is not at `rest`, with room for what its
    electronics and the anti-alias filter make of them."""
    moving = np.flatnonzero(signal != rest) // SLOW_RATIO
    if not moving.size:
        return
    breaks = np.flatnonzero(np.diff(moving) > 2 * SETTLED) + 1
    for part in np.split(moving, breaks):
        stop = min(int(part[-1]) + SETTLED, signal.size // SLOW_RATIO)
        yield slice(max(int(part[0]) - SETTLED, 0), stop)


def set_up(
    rows: Sequence[Row], effects: Effects, rng: np.random.Generator, *, echoes: bool = False
) -> VirtualGunBench:
    """The bench for a plan of shots, every row checked. Raises `ValueError` naming run, column and
    value."""
    for row in rows:
        (
            impactor_of(row),
            target_of(row),
            point_of(row),
            positive(row, "tank_pressure_bar"),
            valve_way_of(row),
        )
    heights = tuple(dict.fromkeys((0.0, *map(chain_height_of, rows))))
    plates = solved_plates((plate_of(row) for row in rows), effects, rng, heights)
    return VirtualGunBench(effects, plates, heights_m=heights, echoes=echoes)
