"""What a withheld campaign's recorder shows of a shot: the tank's pressure over time, and the laser
at the muzzle.

The trace is that of the law that gives the velocity, followed past the exit. A run whose velocity
differs by scatter or background takes so much longer or shorter; the regulator sets its pressure
with a scatter of its own, and a smooth relative error of each configuration, a start of the valve
that is rounded off and the heat of the wall after the exit are what no effect explains.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...virtualbench.campaigns.gun import BULLET_LENGTH_M, LASER, TANK
from ...virtualbench.effects import Effects, EffectSwitch
from ...virtualbench.gun.build import WEAKEST_VALVE, Projectile
from ...virtualbench.gun.fire import LASER_REST_M, fire
from ...virtualbench.gun.gas import ValveWay
from ...virtualbench.second_laws.blow_down import FollowedShot, ValveClosing, follow_shot
from ...virtualbench.second_laws.sensors import pressure_read_bar
from ...virtualbench.sensors import analog, digitised
from ...virtualbench.sensors.chain import converted, written
from .case import Case
from .designs import design
from .gun_case import gun_of, ln_reading, true_pressure_pa
from .run_scatter import CaseRuns, background

#: Recorder of a gun alone; where a force is recorded beside it, its rate holds for all channels.
RATE_HZ = 25_000.0
#: The transducer's noise in one sample: 0.25 % of its 16 bar.
NOISE_BAR = 0.0025 * TANK.full_scale
#: Between which the campaign's figures are drawn, evenly in the logarithm: rest before the drop,
#: lag of the transducer, rounding of the valve's start, time constant of the tank's wall, how long
#: the valve takes to close.
REST_S, LAG_S, START_S, WALL_S, CLOSING_S = (
    (0.03, 0.3),
    (2e-4, 2e-3),
    (5e-4, 5e-3),
    (0.5, 3.0),
    (0.03, 0.2),
)
#: A valve that is closed begins to close so many times as late as the slowest shot leaves the
#: barrel.
CLOSES_AFTER = (1.05, 1.6)
#: How often the valve stays open.
STAYS_OPEN = 0.5
#: The trigger comes late by up to this from shot to shot.
TRIGGER_S = 0.02
#: What the regulator leaves of a deviation of the pressure.
REGULATOR = 0.003
#: ln v over ln p: by so much a deviation of the pressure has part in the scatter of the velocity.
_VELOCITY_OVER_PRESSURE = 0.5
#: A background of one tolerance is this relative error of the trace.
TRACE_TOLERANCE = 0.008
_WAVES = 4
#: A recording goes on for so long after the slowest exit, or after the closing.
AFTER_S = 0.3
_LASER_RATIO = 4


@dataclass(frozen=True)
class Recorder:
    """A campaign's own figures of gun and transducer, s; `closes_after` in slowest exits, infinite
    for never."""

    rest_s: float
    lag_s: float
    start_s: float
    wall_s: float
    closes_after: float
    closing_s: float

    @classmethod
    def of(cls, case: Case) -> Recorder:
        """Drawn by the seed of the case's background."""
        rng = np.random.default_rng([case.background.seed, 13])
        rest, lag, start, wall, closing = (
            float(np.exp(rng.uniform(math.log(low), math.log(high))))
            for low, high in (REST_S, LAG_S, START_S, WALL_S, CLOSING_S)
        )
        after = float(rng.uniform(*CLOSES_AFTER))
        return cls(
            rest, lag, start, wall, math.inf if rng.random() < STAYS_OPEN else after, closing
        )


@dataclass(frozen=True, eq=False)
class ShotRecords:
    """Recordings of a case's runs in their order: by run the channels (n,), and when its bullet's
    tail reaches the vents. `rate_hz` holds for all channels."""

    channels: tuple[dict[str, NDArray[np.float32]], ...]
    exit_s: tuple[float, ...]
    rate_hz: float

    @property
    def samples(self) -> int:
        return self.channels[0]["tank_pressure"].size


def shot_records(
    runs: CaseRuns, true_m_s: Floats, read_m_s: Floats, rng: np.random.Generator
) -> ShotRecords:
    """Tank pressure (V) and laser (V) of runs (R,) with true velocities and velocities as they are
    read, without the noise of the reading."""
    case, plan = runs.case, runs.plan
    rate = RATE_HZ if case.kind == "gun" else case.sampling_rate_hz
    recorder, shots = Recorder.of(case), followed_shots(case)
    weights = (
        TRACE_TOLERANCE * background(case.background, plan, _WAVES, "trace") / math.sqrt(_WAVES)
    )
    spread = runs.spread("gun")
    base = np.array([shot.muzzle_velocity_m_s for shot in shots])[runs.which]
    deviation = np.log(true_m_s / base)
    deviation = deviation - np.array([deviation[runs.which == c].mean() for c in runs.which])
    share = min(_VELOCITY_OVER_PRESSURE * REGULATOR / spread, 1.0) if spread else 0.0
    alone = math.sqrt(1 - share**2)
    regulator = share * REGULATOR * deviation / (
        spread or 1.0
    ) + alone * REGULATOR * rng.standard_normal(len(base))
    longest = max(shot.time_s[-1] for shot in shots) + recorder.rest_s + TRIGGER_S
    time = np.arange(math.ceil(longest * rate)) / rate
    before_pa = [true_pressure_pa(setting, case.strengths, case.laws) for setting in plan]
    rows, exits = [], []
    for r, c in enumerate(runs.which):
        begin = recorder.rest_s + float(rng.uniform(0, TRIGGER_S))
        since = time - begin
        clock = since - recorder.start_s * -np.expm1(-np.maximum(since, 0.0) / recorder.start_s)
        stretch = base[r] / true_m_s[r]
        shot = shots[c]
        gauge = np.interp(clock, stretch * shot.time_s, shot.tank_pressure_pa)
        # Without a valve the law begins when tank and dead volume are filled; before that the tank
        # has what was set.
        gauge = np.where(since < 0, before_pa[c], gauge)
        phase = np.clip(clock / (2 * stretch * shot.exit_s), 0.0, 1.0)
        waves = np.sin(np.pi * np.outer(np.arange(1, _WAVES + 1) / 2, phase))
        gauge = gauge * (1 + regulator[r]) * (1 + weights[c] @ waves)
        exits.append(float(np.interp(stretch * shot.exit_s, clock, time)))
        rows.append(
            {
                "tank_pressure": _transducer(gauge, case, recorder.lag_s, rate, rng),
                "laser": _laser(
                    time.size, rate, exits[-1], float(true_m_s[r]), float(read_m_s[r]), case, rng
                ),
            }
        )
    return ShotRecords(tuple(rows), tuple(exits), rate)


def followed_shots(case: Case) -> tuple[FollowedShot, ...]:
    """The shots (C,) of a case's configurations, without scatter: to the end of the recording.
    Raises `ValueError` for a shot that does not leave the barrel."""
    recorder = Recorder.of(case)
    strengths = tuple(
        sorted(
            (n, v) for n, v in case.strengths.items() if n.startswith(("gun.", "sensor.pressure"))
        )
    )
    return _followed(case.kind, case.design, strengths, case.laws, recorder)


@lru_cache(maxsize=16)
def _followed(
    kind: str, number: int, strengths: tuple[tuple[str, float], ...], laws: str, recorder: Recorder
) -> tuple[FollowedShot, ...]:
    exits = [shot.exit_s for shot in _all(kind, number, strengths, laws, ValveClosing(), 0.0)]
    if not all(math.isfinite(moment) for moment in exits):
        raise ValueError(f"design {number} of {kind}: a shot does not leave the barrel")
    at = recorder.closes_after * max(exits)
    closing = ValveClosing(at, recorder.closing_s, recorder.wall_s)
    until = max(exits) + AFTER_S if math.isinf(at) else at + recorder.closing_s + AFTER_S / 3
    return tuple(_all(kind, number, strengths, laws, closing, until))


def _all(
    kind: str,
    number: int,
    strengths: tuple[tuple[str, float], ...],
    laws: str,
    closing: ValveClosing,
    until_s: float,
) -> Iterator[FollowedShot]:
    """Up to the exit alone where `until_s` is 0."""
    gun, given = gun_of(kind, number), dict(strengths)
    for setting in design(kind, number):
        pressure, bullet = true_pressure_pa(setting, given, laws), Projectile(setting.mass_kg)
        if laws:
            yield follow_shot(gun, given, laws, pressure, bullet, until_s=until_s, closing=closing)
            continue
        effects = Effects(
            tuple(
                EffectSwitch(name, strength=v) for name, v in strengths if name.startswith("gun.")
            )
        )
        valve_way, valve = None, effects["gun.valve_flow"]
        if (
            math.isfinite(closing.at_s) and valve >= WEAKEST_VALVE
        ):  # an ideal valve of the bench itself stays open
            opened = gun.valve_opening_time_s
            begin = max(closing.at_s / valve, 1.001 * opened)
            valve_way = ValveWay(
                (0.0, opened, begin, begin + closing.takes_s / valve), (0.0, 1.0, 1.0, 0.0)
            )
        rng = np.random.default_rng(0)
        shot = fire(
            gun, effects, pressure, bullet, rng, until_s=until_s or 1.2, valve_way=valve_way
        )
        yield FollowedShot(
            shot.time_s, shot.tank_pressure_pa, shot.exit_time_s, shot.muzzle_velocity_m_s
        )


def _transducer(
    gauge_pa: Floats, case: Case, lag_s: float, rate_hz: float, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Volts (n,) of true gauge pressures: gain and offset, a first-order lag, noise, and a
    converter of 16 bits."""
    from scipy.signal import lfilter

    read_bar = pressure_read_bar(gauge_pa / 1e5, case.strengths, case.laws)
    decay = math.exp(-1 / (rate_hz * lag_s))
    lagged, _ = lfilter([1 - decay], [1.0, -decay], read_bar, zi=[decay * read_bar[0]])
    return converted(
        written(1e5 * (lagged + NOISE_BAR * rng.standard_normal(read_bar.size)), TANK), TANK
    )


def _laser(
    samples: int,
    rate_hz: float,
    exit_s: float,
    true_m_s: float,
    read_m_s: float,
    case: Case,
    rng: np.random.Generator,
) -> NDArray[np.float32]:
    """Volts (n,). The bullet is in the beam for its stated length over the velocity that is read:
    it is shorter than stated where the reading is too large."""
    gun = gun_of(case.kind, case.design)
    leave = exit_s + (gun.laser_position_m - gun.vent_position_m) / true_m_s
    enter = leave - BULLET_LENGTH_M / read_m_s
    time = np.arange(samples * _LASER_RATIO) / (rate_hz * _LASER_RATIO)
    step = time[1]
    edges = np.clip((time - enter) / step + 0.5, 0, 1) - np.clip((time - leave) / step + 0.5, 0, 1)
    distance = LASER_REST_M - Projectile().diameter_m * edges
    effects = Effects((EffectSwitch("bench.noise"),))
    return digitised(analog(time, distance, LASER, rate_hz, effects), LASER, rate_hz, effects, rng)


def velocities_as_read(runs: CaseRuns, true_m_s: Floats) -> Floats:
    """Velocities (R,) that the stated bullet length gives, without noise, at true ones."""
    reading = ln_reading(runs.settings, np.log(true_m_s), runs.case.strengths, runs.case.laws)
    return np.asarray(true_m_s * np.exp(reading))


#: The channels as campaign.toml has them.
SENSORS = (replace(TANK, noise=NOISE_BAR, bandwidth_hz=None), LASER)
