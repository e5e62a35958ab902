"""The second laws of the gun: tank, breech and a side cavity, with the projectile, in absolute
pressures.

`table.LAWS` names each law's source; here it stands as an equation. Strength s of each:

- back pressure: s atmospheres ahead; development: (m + rho A l) dv/dt with l the column in front,
  and one head of its outflow; sealed: the pressure of Rankine and Hugoniot on a piston of Mach
  number v / c;
- leak: development: m' = A sqrt((p1^2 - p2^2) / (R T (K - 2 ln r))) with K = f L / h, choked where
  that is largest; sealed: m' = pi d h^3 (p1^2 - p2^2) (1 + 1.5 e^2) / (24 mu L R T), h = 0.15 mm,
  times s;
- valve: s times an opening time (1.9 of the first law's) and 1 / s of the area; development: m' = A
  Y sqrt(2 rho dp), Y = 1 - x / (3 x_T); sealed: C(r) A times the nozzle's flow;
- bore: development: s A rho v^2 / 2 (f x / 3 D + 1.5); sealed: p (1 - s (gamma - 1) / 2 v / c)^(2
  gamma / (gamma - 1));
- friction: development: s k pi D sqrt(eta v p_c l); sealed: s k mu N / (1 + v / v0);
- heat: development: s times Dittus and Boelter's film on the bore; sealed: m cv (T_wall - T) s /
  tau;
- dead volume: s times the build's; development: with s times 6 W/K to its walls; sealed: behind a
  hole of 1.4 cm^2.

The laws for calibration stand in `gun_calibration`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import cache

import numpy as np
from numba import njit

from ...array_types import Floats
from ..effects import Effects
from ..gun.build import (
    SMALLEST_BREECH_M3,
    VACUUM_PA,
    WEAKEST_VALVE,
    GunBuild,
    Projectile,
    setting_of,
)
from ..gun.fire import crossings, velocity_at
from ..gun.gas import CHOKED, COLDEST_K, CP, CRITICAL_RATIO, CV, GAMMA, GAS_CONSTANT, HOTTEST_K
from ..gun.motion import AIR_VISCOSITY_PA_S, CREEP_M_S
from .gun_calibration import (
    FREE_MUZZLE,
    FULL_HOSE_PA,
    HOLE_RATIO,
    LEAST_ROOM,
    LIFTED_SHARE,
    LIFTING_PA,
    LINE_M,
    POPPET_RATIO,
    SLACK_SHARE,
    THROWN_OPENING,
    WIRE_AREA,
    hose_pressure_pa,
    lip_friction_n,
    natural_film_w_m2_k,
    poppet_lift,
    smooth_drop_pa,
    sonic_flow,
)
from .owners import bullet_factor
from .table import checked_split

#: IEC 60534-2-1, full-bore ball valve: the drop of pressure over the inlet's at which it chokes,
#: times F_gamma = 1.
VALVE_CHOKED_DROP = 0.42
#: A port that opens along a straight line or a cosine takes 0.47 s for the delay that the first
#: law's port, which is nearly shut for half of its travel, has in 0.25 s.
SLOWER_OPENING = 0.47 / 0.25
#: Perry's discharge coefficient of a sharp-edged orifice over the ratio of pressures, rising
#: powers.
PERRY = (0.8414, -0.1002, 0.8415, -3.9, 4.6001, -1.6827)
ROUGHNESS_M, FITTING_HEADS = 5e-5, 1.5
TIGHT_CLEARANCE_M, ECCENTRICITY = 1.5e-4, 0.7
#: Grease in a seal, pressed on the wall by its squeeze and by the gas, so long.
FILM_PA_S, SQUEEZE_PA, LAND_M = 0.1, 3e5, 2e-3
PRESS_FIT_N, PRESS_FRICTION, WARMING_M_S = 15.0, 0.3, 8.0
AIR_CONDUCTIVITY_W_M_K, PRANDTL = 0.026, 0.71
RELAXATION_S = 1.5
DEAD_WALL_W_K = 6.0
CAVITY_HOLE_M2 = 0.7 * 2e-4
#: A smaller cavity is none: it fills at once, and holds nothing.
SMALLEST_CAVITY_M3 = 1e-6
#: A valve that stays open closes at this time.
NEVER_S = 1e9
_CHUNK_S, _STEP_S, _UNTIL_S = 0.1, 2e-4, 1.2
_TOLERANCES = np.array([1e-9, 1e-4, 1e-9, 1e-4, 1e-9, 1e-4, 1e-6, 1e-5])

# fmt: off
(TANK_M3, BREECH_M3, CAVITY_M3, AREA, MASS, TRAVEL, BORE, AMBIENT, WALL_K, MERGED, VALVE_M2, OPEN_S,
VALVE_LAW,
 COULOMB, FILM, PRESS, LEAK_M2, LEAK_K, LEAK_R, LAMINAR, ROUGH, WAVE, TURBULENT, RELAX, DEAD_W_K,
 COLUMN,
 SHOCK, CLOSE_AT, CLOSE_S, ORIFICE_M2, LIP_M2_PA, SMOOTH, RUBBER, WIRES_M2, HOSE_M3_PA) = range(35)
# fmt: on
FIGURES = 35
#: Laws of valves and of the holes behind them (VALVE_LAW).
CONTROL_VALVE, DISC_VALVE, POPPET_VALVE = 0.0, 1.0, 2.0


def muzzle_velocity_m_s(
    gun: GunBuild,
    strengths: Mapping[str, float],
    split: str,
    tank_pressure_pa: float,
    projectile: Projectile,
) -> float:
    """Velocity at the vents (m/s) of a shot from a gauge pressure; 0 where it does not reach them
    within 1.2 s.

    Raises `RuntimeError` where the integrator gives up.
    """
    figures = shot_figures(gun, strengths, split, projectile)
    time, rows, exit_s = run_to_vents(figures, tank_pressure_pa, gun.vent_position_m)
    return (
        float(velocity_at(time, rows[:, 6], rows[:, 7], np.array([exit_s]))[0])
        if math.isfinite(exit_s)
        else 0.0
    )


def run_to_vents(
    figures: Floats, tank_pressure_pa: float, vent_position_m: float
) -> tuple[Floats, Floats, float]:
    """Times (n,) from the valve's opening on, states (n, 8) up to the first ones past the vents,
    and when the tail reaches them: NaN where it does not within 1.2 s. Raises `RuntimeError` where
    the integrator gives up."""
    state = np.zeros(8)
    ambient, wall = figures[AMBIENT], figures[WALL_K]
    pressures = (tank_pressure_pa + ambient, ambient, ambient)
    for chamber, (pressure, volume) in enumerate(
        zip(pressures, figures[[TANK_M3, BREECH_M3, CAVITY_M3]], strict=True)
    ):
        state[2 * chamber] = pressure * volume / (GAS_CONSTANT * wall)
        state[2 * chamber + 1] = state[2 * chamber] * CV * wall
    times, states = [np.zeros(1)], [state[None]]
    while (start := float(times[-1][-1])) < _UNTIL_S - 1e-9:
        stop = start + _CHUNK_S
        if not figures[MERGED] and start < figures[OPEN_S] - 1e-6:
            stop = min(stop, float(figures[OPEN_S]))  # the flow has a kink where the valve is open
        time, rows = integrated(rates, states[-1][-1], start, stop, figures)
        times.append(time[1:])
        states.append(rows[1:])
        past = crossings(time, rows[:, 6], rows[:, 7], vent_position_m)
        if past.size:
            return np.concatenate(times), np.concatenate(states), float(past[0])
        if rows[-1, 6] < -1e-3:
            break
    return np.concatenate(times), np.concatenate(states), math.nan


def integrated(
    law: Callable[..., Floats], state: Floats, start: float, stop: float, figures: Floats
) -> tuple[Floats, Floats]:
    """Times (k,) from start to stop, both included, and states (k, 8) by rates like `rates`.

    Raises `RuntimeError` where the integrator gives up.
    """
    from scipy.integrate import odeint

    time = np.linspace(start, stop, max(2, round((stop - start) / _STEP_S) + 1))
    rows, solver_report = odeint(
        law,
        state,
        time,
        args=(figures,),
        tfirst=True,
        full_output=True,
        rtol=1e-6,
        atol=_TOLERANCES,
        mxstep=20_000,
    )  # type: ignore[call-overload]
    if solver_report["message"] != "Integration successful.":
        raise RuntimeError(
            f"the shot could not be integrated past {start:.4g} s: {solver_report['message']}"
        )
    return time, np.asarray(rows)


def shot_figures(
    gun: GunBuild, strengths: Mapping[str, float], split: str, projectile: Projectile
) -> Floats:
    """The figures (35,) of a shot whose valve stays open, in the order of the names above.

    Raises `ValueError` for a split without laws.
    """
    checked_split(split)

    def of(name: str, law: str) -> float:
        return strengths.get(name, 0.0) if split == law else 0.0

    base = setting_of(gun, Effects.none(), 0.0, projectile, np.random.default_rng(0))
    first, middle, last, factor = (
        "development",
        "calibration",
        "sealed",
        bullet_factor(projectile.mass_kg),
    )
    valve = strengths.get("gun.valve_flow", 0.0)
    valve = valve if valve >= WEAKEST_VALVE else 0.0
    dead = strengths.get("gun.dead_volume", 0.0) * gun.dead_volume_m3
    ring, friction, choked = _ring(gun, projectile, factor)
    clearance = TIGHT_CLEARANCE_M * factor
    laminar = math.pi * projectile.diameter_m * clearance**3 * (1 + 1.5 * ECCENTRICITY**2)
    f = np.zeros(FIGURES)
    f[TANK_M3], f[AREA], f[MASS], f[TRAVEL], f[BORE] = (
        base.tank_volume_m3, base.area_m2, base.mass_kg, base.travel_m, base.bore_m,
    )  # fmt: skip
    shares = {first: 1.0, middle: SLACK_SHARE, last: 0.0}
    f[BREECH_M3] = max(shares[split] * dead, SMALLEST_BREECH_M3 if valve else 0.0)
    f[CAVITY_M3] = dead if split == last and dead > SMALLEST_CAVITY_M3 else 0.0
    f[AMBIENT] = max(strengths.get("gun.back_pressure", 0.0) * gun.atmosphere_pa, VACUUM_PA)
    f[WALL_K], f[MERGED] = gun.temperature_k, float(valve == 0)
    f[VALVE_M2] = 0.0 if valve == 0 else math.pi * gun.valve_bore_m**2 / 4 / valve
    f[VALVE_M2] *= (
        1.0 if split == last else gun.valve_discharge
    )  # Perry's coefficient is in the law
    slower = THROWN_OPENING if split == middle else SLOWER_OPENING
    f[OPEN_S] = valve * slower * gun.valve_opening_time_s
    f[VALVE_LAW] = {first: CONTROL_VALVE, middle: POPPET_VALVE, last: DISC_VALVE}[split]
    f[COULOMB] = base.coulomb_force_n
    film = of("gun.sliding_friction", first) * factor
    f[FILM] = film * math.pi * projectile.diameter_m * math.sqrt(FILM_PA_S * LAND_M)
    f[PRESS] = of("gun.sliding_friction", last) * factor * PRESS_FIT_N * PRESS_FRICTION
    f[LEAK_M2], f[LEAK_K], f[LEAK_R] = of("gun.blow_by", first) * ring, friction, choked
    f[LAMINAR] = (
        of("gun.blow_by", last)
        * laminar
        / (24 * AIR_VISCOSITY_PA_S * projectile.length_m * GAS_CONSTANT)
    )
    f[ROUGH], f[WAVE] = of("gun.barrel_loss", first), of("gun.barrel_loss", last)
    f[TURBULENT], f[RELAX] = of("gun.heat_exchange", first), of("gun.heat_exchange", last)
    f[DEAD_W_K] = DEAD_WALL_W_K * of("gun.dead_volume", first)
    f[COLUMN], f[SHOCK] = (float(of("gun.back_pressure", law) > 0) for law in (first, last))
    f[CLOSE_AT], f[CLOSE_S] = NEVER_S, 1.0
    if split == middle:
        if of("gun.back_pressure", middle) > 0:  # the air ahead takes the place of a side cavity
            f[ORIFICE_M2], f[CAVITY_M3] = FREE_MUZZLE * base.area_m2, base.area_m2 * base.travel_m
        f[LIP_M2_PA] = of("gun.blow_by", middle) * LIFTED_SHARE * ring / LIFTING_PA
        f[SMOOTH] = of("gun.barrel_loss", middle)
        f[RUBBER] = of("gun.sliding_friction", middle) * factor
        shell = (36 * math.pi) ** (1 / 3) * gun.tank_volume_m3 ** (2 / 3)
        f[WIRES_M2] = of("gun.heat_exchange", middle) * WIRE_AREA * shell
        f[HOSE_M3_PA] = (1 - SLACK_SHARE) * dead / FULL_HOSE_PA
    return f


def _ring(gun: GunBuild, projectile: Projectile, factor: float) -> tuple[float, float, float]:
    """Area (m2) of the ring, its friction f L / h by Hirs, and the ratio of pressures at which it
    is choked."""
    clearance = (gun.bore_diameter_m - projectile.diameter_m) / 2 * factor
    reynolds = 1e4
    friction = 0.066 * reynolds**-0.25 * projectile.length_m / clearance
    return math.pi * projectile.diameter_m * clearance, friction, choked_ratio(round(friction, 6))


@cache
def choked_ratio(friction: float) -> float:
    """The ratio of pressures r at which (1 - r^2) / (K - 2 ln r), the squared isothermal flow, is
    largest."""
    from scipy.optimize import minimize_scalar

    best = minimize_scalar(
        lambda r: -(1 - r * r) / (friction - 2 * math.log(r)),
        bounds=(1e-6, 1 - 1e-9),
        method="bounded",
    )
    return float(best.x)


@njit(cache=True)
def shock_pressure(ambient: float, mach: float) -> float:
    """Pressure (Pa) behind the shock that a piston of this Mach number (0 or more) drives into air
    at rest."""
    quarter = (GAMMA + 1) / 4 * mach
    ratio: float = 1 + GAMMA * mach * (quarter + math.sqrt(1 + quarter * quarter))
    return ambient * ratio


@njit(cache=True)
def gas_state(mass: float, energy: float, volume: float) -> tuple[float, float, float]:
    """Pressure, temperature, density."""
    if mass <= 0 or energy <= 0 or volume <= 0:
        return 0.0, COLDEST_K, 0.0
    temperature = min(max(energy / (mass * CV), COLDEST_K), HOTTEST_K)
    return (GAMMA - 1) * energy / volume, temperature, mass / volume


@njit(cache=True)
def hose_state(mass: float, energy: float, volume: float, f: Floats) -> tuple[float, float, float]:
    """As `gas_state`, where the breech may have a hose: the energy then holds the hose's."""
    if f[HOSE_M3_PA] <= 0 or mass <= 0 or energy <= 0 or volume <= 0:
        return gas_state(mass, energy, volume)
    pressure = hose_pressure_pa(energy, volume, f[HOSE_M3_PA], f[AMBIENT])
    wide = max(volume + f[HOSE_M3_PA] * (pressure - f[AMBIENT]), 0.2 * volume)
    return gas_state(mass, pressure * wide / (GAMMA - 1), wide)


@njit(cache=True)
def nozzle(pressure: float, temperature: float, ratio: float) -> float:
    """Mass flow (kg/s) through 1 m2, isentropic; straight within a thousandth of equal
    pressures."""
    unit = pressure / math.sqrt(GAS_CONSTANT * temperature)
    if ratio <= CRITICAL_RATIO:
        return CHOKED * unit
    held = min(ratio, 0.999)
    root = held ** ((GAMMA - 1) / GAMMA)
    flow: float = unit * math.sqrt(2 * GAMMA / (GAMMA - 1) * (held / root) ** 2 * (1 - root))
    return flow * (1 - ratio) / 0.001 if ratio > held else flow


@njit(cache=True)
def control_valve(pressure: float, density: float, ratio: float) -> float:
    """Mass flow (kg/s) through 1 m2 by IEC 60534-2-1: Y sqrt(2 rho dp), choked at the valve's own
    drop."""
    drop = min(1 - ratio, VALVE_CHOKED_DROP)
    factor = 1 - drop / (3 * VALVE_CHOKED_DROP)
    root = drop / math.sqrt(drop + 1e-3)  # the root's infinite slope at equal pressures made finite
    flow: float = factor * root * math.sqrt(2 * density * pressure)
    return flow


@njit(cache=True)
def perry_coefficient(ratio: float) -> float:
    """Discharge coefficient of a sharp-edged orifice over the ratio of pressures."""
    total = 0.0
    for power in range(5, -1, -1):
        total = total * ratio + PERRY[power]
    return total


@njit(cache=True)
def _through_valve(time: float, up: tuple[float, float, float], ratio: float, f: Floats) -> float:
    if f[VALVE_LAW] == POPPET_VALVE:
        lift = min(
            poppet_lift(time, up[0], f[OPEN_S]), max(1 - (time - f[CLOSE_AT]) / f[CLOSE_S], 0.0)
        )
        return float(f[VALVE_M2] * lift * sonic_flow(up[0], up[1], ratio, POPPET_RATIO))
    turned = min(max(time / f[OPEN_S], 0.0), 1.0, max(1 - (time - f[CLOSE_AT]) / f[CLOSE_S], 0.0))
    if f[VALVE_LAW] == CONTROL_VALVE:
        return float(f[VALVE_M2] * turned * control_valve(up[0], up[2], ratio))
    share = 1 - math.cos(math.pi / 2 * turned)
    return float(f[VALVE_M2] * share * perry_coefficient(ratio) * nozzle(up[0], up[1], ratio))


@njit(cache=True)
def _leak(gas: tuple[float, float, float], ahead: float, f: Floats) -> float:
    if gas[0] <= ahead:
        return 0.0
    flow = f[LAMINAR] * (gas[0] ** 2 - ahead**2) / gas[1]
    if f[LEAK_M2] > 0:
        ratio = max(ahead / gas[0], f[LEAK_R])
        near = min(ratio, 0.9999)
        root = math.sqrt((1 - near * near) / (f[LEAK_K] - 2 * math.log(near)))
        if ratio > near:
            root *= (1 - ratio) / (1 - near)
        flow += f[LEAK_M2] * gas[0] / math.sqrt(GAS_CONSTANT * gas[1]) * root
    if f[LIP_M2_PA] > 0:
        flow += (
            f[LIP_M2_PA]
            * (gas[0] - ahead)
            * sonic_flow(gas[0], gas[1], ahead / gas[0], CRITICAL_RATIO)
        )
    return float(flow)


@njit(cache=True)
def rough_factor(bore: float) -> float:
    """Darcy's friction factor of a fully rough wall."""
    factor: float = (1.14 + 2 * math.log10(bore / ROUGHNESS_M)) ** -2
    return factor


@njit(cache=True)
def _vent_muzzle(air: tuple[float, float, float], speed: float, f: Floats, rate: Floats) -> None:
    """What the air ahead gains by a projectile's work and loses through the muzzle's orifice, in
    its rates."""
    rate[5] += air[0] * f[AREA] * speed
    if air[0] > f[AMBIENT]:
        out = f[ORIFICE_M2] * sonic_flow(air[0], air[1], f[AMBIENT] / air[0], HOLE_RATIO)
        rate[4] -= out
        rate[5] -= out * CP * air[1]
    elif air[0] < f[AMBIENT]:
        entering = f[ORIFICE_M2] * sonic_flow(
            f[AMBIENT], f[WALL_K], air[0] / f[AMBIENT], HOLE_RATIO
        )
        rate[4] += entering
        rate[5] += entering * CP * f[WALL_K]


@njit(cache=True)
def rates(time: float, state: Floats, f: Floats) -> Floats:
    """Rates (8,): mass and energy of tank, breech and cavity (or the air ahead), position and
    velocity."""
    x, v = state[6], state[7]
    volume = max(f[BREECH_M3] + f[AREA] * x, 0.2 * f[BREECH_M3])
    rate = np.zeros(8)
    if f[MERGED]:
        tank = hose_state(state[0] + state[2], state[1] + state[3], f[TANK_M3] + volume, f)
        breech = tank
    else:
        tank = gas_state(state[0], state[1], f[TANK_M3])
        breech = hose_state(state[2], state[3], volume, f)
        flow = 0.0
        if tank[0] > breech[0]:
            flow = _through_valve(time, tank, breech[0] / tank[0], f)
            enthalpy = flow * CP * tank[1]
        elif tank[0] < breech[0]:
            flow = -_through_valve(time, breech, tank[0] / breech[0], f)
            enthalpy = flow * CP * breech[1]
        if flow != 0.0:
            rate[0] -= flow
            rate[1] -= enthalpy
            rate[2] += flow
            rate[3] += enthalpy
    wave = 1.0
    if f[WAVE] > 0 and v > 0:
        speed = math.sqrt(GAMMA * GAS_CONSTANT * breech[1])
        wave = max(1 - f[WAVE] * (GAMMA - 1) / 2 * v / speed, 0.0) ** (2 * GAMMA / (GAMMA - 1))
    pressure = breech[0] * wave
    ahead, mass = f[AMBIENT], f[MASS]
    density = f[AMBIENT] / (GAS_CONSTANT * f[WALL_K])
    if f[SHOCK] > 0 and v > 0:
        ahead = shock_pressure(f[AMBIENT], v / math.sqrt(GAMMA * GAS_CONSTANT * f[WALL_K]))
    if f[COLUMN] > 0:
        mass += density * f[AREA] * max(f[TRAVEL] - x, 0.0)
        ahead = max(
            ahead + density * v * abs(v) / 2, 0.0
        )  # a trial step may go backwards faster than sound
    if f[ORIFICE_M2] > 0:
        air = gas_state(state[4], state[5], f[AREA] * max(f[TRAVEL] - x, LEAST_ROOM * f[TRAVEL]))
        ahead = air[0]
        _vent_muzzle(air, v if x < (1 - LEAST_ROOM) * f[TRAVEL] else 0.0, f, rate)
    leak = _leak(breech, ahead, f)
    if f[ORIFICE_M2] > 0:
        rate[4] += leak
        rate[5] += leak * CP * breech[1]
    rate[2] -= leak
    rate[3] -= leak * CP * breech[1] + pressure * f[AREA] * v
    if f[CAVITY_M3] > 0 and f[ORIFICE_M2] == 0:
        cavity = gas_state(state[4], state[5], f[CAVITY_M3])
        fill, filled = 0.0, 0.0
        if breech[0] > cavity[0]:
            fill = CAVITY_HOLE_M2 * nozzle(breech[0], breech[1], cavity[0] / breech[0])
            filled = fill * CP * breech[1]
        elif breech[0] < cavity[0]:
            fill = -CAVITY_HOLE_M2 * nozzle(cavity[0], cavity[1], breech[0] / cavity[0])
            filled = fill * CP * cavity[1]
        rate[2] -= fill
        rate[3] -= filled
        rate[4] += fill
        rate[5] += filled
    heat = f[DEAD_W_K] * (f[WALL_K] - breech[1])
    if f[TURBULENT] > 0 and x > 0:
        reynolds = breech[2] * abs(v) / 2 * f[BORE] / AIR_VISCOSITY_PA_S
        film = 0.023 * reynolds**0.8 * PRANDTL**0.4 * AIR_CONDUCTIVITY_W_M_K / f[BORE]
        heat += f[TURBULENT] * film * math.pi * f[BORE] * x * (f[WALL_K] - breech[1])
    if f[RELAX] > 0:
        share = f[RELAX] / RELAXATION_S * CV
        rate[1] += share * max(state[0], 0.0) * (f[WALL_K] - tank[1])
        heat += share * max(state[2], 0.0) * (f[WALL_K] - breech[1])
    if f[WIRES_M2] > 0:
        film = natural_film_w_m2_k(tank[2], tank[1], f[WALL_K])
        rate[1] += f[WIRES_M2] * film * (f[WALL_K] - tank[1])
    rate[3] += heat
    friction = f[COULOMB] + f[PRESS] / (1 + abs(v) / WARMING_M_S)
    friction += f[FILM] * math.sqrt(abs(v) * (SQUEEZE_PA + max(breech[0] - ahead, 0.0)))
    if f[RUBBER] > 0:
        friction += f[RUBBER] * lip_friction_n(breech[0] - ahead)
    force = (pressure - ahead) * f[AREA] - friction * math.tanh(v / CREEP_M_S)
    if f[ROUGH] > 0:
        heads = rough_factor(f[BORE]) * max(x, 0.0) / (3 * f[BORE]) + FITTING_HEADS
        force -= f[ROUGH] * f[AREA] * breech[2] * v * abs(v) / 2 * heads
    if f[SMOOTH] > 0:
        force -= f[SMOOTH] * f[AREA] * smooth_drop_pa(breech[2], v, max(x, 0.0) + LINE_M, f[BORE])
    rate[6] = v
    rate[7] = force / mass
    return rate
