"""The compiled motion of the gun: rates of one shot, and steps of one shot after the other until
each has ended.

The physics is that of `chambers`, which hands over a table of the shots' quantities. One gas is
integrated by Dormand and Prince's step, two gases by Rodas5P with derivatives in closed form; both
control their steps and meet the vent holes as `ode.run` does. Only shots without hooks of effects
come here; `ode.run` integrates the others, with the same rates.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from ..ode import (
    AT_TARGET,
    DORMAND_PRINCE_ERROR,
    DORMAND_PRINCE_NODES,
    DORMAND_PRINCE_STAGES,
    GAMMA,
    RODAS_NODES,
    RODAS_SIDE,
    RODAS_STATE,
    RODAS_TIMES,
)

#: What the rates of one shot depend on, SI; R T stands for temperatures.
QUANTITIES = np.dtype(
    [
        (name, np.float64)
        for name in (
            "area_m2",  # that the gas pushes on
            "mass_kg",
            "index",  # polytropic
            "volume_m3",  # behind the projectile at rest
            "zero_pa",  # absolute pressure at which the law's pressure is 0
            "drag_n",  # constant
            "outside_pa",
            "outside_rt",
            "critical_ratio",
            "leak_m2",  # area of flow times c*
            "gauge_leak_m2",  # the same, for a choked flow at the pressure above the surroundings
            "wall_1_m",  # Darcy's friction factor over the bore's diameter
            "air_density_kg_m3",  # of outside air, times the dynamic heads that it loses
            "gas_heads",
            "tank_m3",
            "valve_m2",  # area of flow times c*; 0 without a valve
            "travel_m",
            "patience_s",  # after which a shot counts as one that stays in the barrel
            "creep_m_s",  # a projectile that is slower is at rest
        )
    ]
)

# ISO 6358 has an infinite slope at equal pressures, which no flow has: below a drop of some 1e-4 it
# is laminar.
_LAMINAR = 1e-3
# Air that fills an empty volume is 1.4 times as warm as it was. In a volume that leaks into a
# vacuum, behind a valve that has hardly opened, the mass is smaller than a step's error: it may be
# negative, and has no temperature.
_HOTTEST = 10.0
#: How a shot's integration ended.
REACHED, GIVEN_UP, TOO_MANY_STEPS = 0, 1, 2
#: Steps of a shot that are remembered; what came before the last so many counts as the start.
_REMEMBERED_STEPS = 2048

_DP_NODES, _DP_ERROR = np.array(DORMAND_PRINCE_NODES), np.array(DORMAND_PRINCE_ERROR)
_DP_STAGES = np.stack([np.pad(row, (0, 7 - row.size)) for row in DORMAND_PRINCE_STAGES])
_RODAS_NODES, _RODAS_TIMES = np.array(RODAS_NODES), np.array(RODAS_TIMES)
_RODAS_STATE, _RODAS_SIDE = (
    np.stack([np.pad(row, (0, 8 - row.size)) for row in rows]) for rows in (RODAS_STATE, RODAS_SIDE)
)


@njit(nogil=True, error_model="numpy")
def valve_motion(valve, time):  # type: ignore[no-untyped-def]
    """How a valve (2, k) moves from a moment on: since when evenly, from which position, how fast,
    and up to when.

    Numbers, since no step passes a corner: an array would be handed on, and its references counted,
    at each evaluation.
    """
    last = valve.shape[1] - 1
    if last < 0:
        return 0.0, 1.0, 0.0, math.inf
    if time >= valve[0, last]:
        return valve[0, last], valve[1, last], 0.0, math.inf
    if time < valve[0, 0]:
        return 0.0, valve[1, 0], 0.0, valve[0, 0]
    i = 0
    while valve[0, i + 1] <= time:
        i += 1
    rate = (valve[1, i + 1] - valve[1, i]) / (valve[0, i + 1] - valve[0, i])
    return valve[0, i], valve[1, i], rate, valve[0, i + 1]


@njit(nogil=True, error_model="numpy")
def open_share(turned):  # type: ignore[no-untyped-def]
    """Share of a ball valve's area that is open at a position of 0 to 1, and its derivative by the
    latter.

    Its passage moves in front of the bore by an even share of the diameter. Two circles of one size
    whose centres are a share s of their diameter apart have 2 / pi (acos s - s sqrt(1 - s^2)) of
    their area in common.
    """
    if turned >= 1.0:
        return 1.0, 0.0
    if turned <= 0.0:
        return 0.0, 0.0
    apart = 1 - turned
    half_chord = math.sqrt(1 - apart * apart)
    return (math.acos(apart) - apart * half_chord) * (2 / math.pi), half_chord * (4 / math.pi)


@njit(nogil=True, error_model="numpy")
def ellipse(pressure_ratio, critical):  # type: ignore[no-untyped-def]
    """phi for ratios up to 1, with a finite slope at 1; and its derivative."""
    if pressure_ratio <= critical:
        return 1 / math.sqrt(1 + _LAMINAR), 0.0
    over = (pressure_ratio - critical) / (1 - critical)
    free = 1 - over * over
    root = math.sqrt(free + _LAMINAR)
    return free / root, -over / (1 - critical) * (free + 2 * _LAMINAR) / (root * (free + _LAMINAR))


@njit(nogil=True, error_model="numpy")
def mass_flow(area_m2, pressure_pa, rt, other_pa, other_rt, critical):  # type: ignore[no-untyped-def]
    """kg/s from here to the other side, by the area of flow times c*; negative where the other
    side's pressure is higher."""
    if pressure_pa >= other_pa:
        return area_m2 * pressure_pa / math.sqrt(rt) * ellipse(other_pa / pressure_pa, critical)[0]
    return -area_m2 * other_pa / math.sqrt(other_rt) * ellipse(pressure_pa / other_pa, critical)[0]


@njit(nogil=True, error_model="numpy")
def _flow_derivatives(area_m2, pressure_pa, rt, other_pa, other_rt, critical):  # type: ignore[no-untyped-def]
    """Of `mass_flow`: itself, and by both pressures, both R T."""
    if pressure_pa >= other_pa:
        speed = area_m2 / math.sqrt(rt)
        ratio = other_pa / pressure_pa
        phi, slope = ellipse(ratio, critical)
        flow = speed * pressure_pa * phi
        return flow, speed * (phi - ratio * slope), speed * slope, -flow / (2 * rt), 0.0
    speed = -area_m2 / math.sqrt(other_rt)
    ratio = pressure_pa / other_pa
    phi, slope = ellipse(ratio, critical)
    flow = speed * other_pa * phi
    return flow, speed * slope, speed * (phi - ratio * slope), 0.0, -flow / (2 * other_rt)


@njit(nogil=True, error_model="numpy")
def _gas_rt(absolute, volume, mass, outside_rt):  # type: ignore[no-untyped-def]
    """R T of gas, at most `_HOTTEST` times that outside; and whether it is less than that."""
    most = _HOTTEST * outside_rt
    if absolute * volume < most * mass:
        return absolute * volume / mass, True
    return most, False


@njit(nogil=True, error_model="numpy")
def _leak(q, absolute, rt):  # type: ignore[no-untyped-def]
    """kg/s past the projectile. Gauge pressure is that above the surroundings, whatever the law
    counts from."""
    leak = 0.0
    if q.leak_m2 > 0:
        leak = mass_flow(q.leak_m2, absolute, rt, q.outside_pa, q.outside_rt, q.critical_ratio)
    if q.gauge_leak_m2 > 0 and absolute > q.outside_pa:
        leak += q.gauge_leak_m2 * (absolute - q.outside_pa) / math.sqrt(rt)
    return leak


@njit(nogil=True, error_model="numpy")
def _rates(q, since, position_then, rate, time, state, leak, resistance, rates):  # type: ignore[no-untyped-def]
    """Rates of one shot, of 4 quantities or 6; `leak` and `resistance` are what hooks add."""
    position, velocity, pressure, mass = state[0], state[1], state[2], state[3]
    volume = q.volume_m3 + q.area_m2 * position
    absolute = pressure + q.zero_pa
    rt, _ = _gas_rt(absolute, volume, mass, q.outside_rt)
    inflow = carried = 0.0
    if state.size == 6:
        tank = state[4] + q.zero_pa
        tank_rt = tank * q.tank_m3 / state[5]
        area = q.valve_m2 * open_share(position_then + rate * (time - since))[0]
        inflow = mass_flow(area, tank, tank_rt, absolute, rt, q.critical_ratio)
        carried = (tank_rt if inflow > 0 else rt) * inflow
        rates[4] = -q.index / q.tank_m3 * carried
        rates[5] = -inflow
    leak += _leak(q, absolute, rt)
    lost = (rt if leak > 0 else q.outside_rt) * leak
    speed = max(velocity, 0.0)
    heads = (
        q.wall_1_m * position * (mass / volume)
        + q.air_density_kg_m3
        + q.gas_heads * max(pressure, 0.0) / rt
    )
    push = pressure * q.area_m2
    force = push - q.drag_n - q.area_m2 * heads * speed * speed / 2 - resistance
    # Friction holds a projectile at rest; it does not pull it back, and a corner there would stop
    # the steps.
    if force < 0:
        force *= min(max(velocity / q.creep_m_s, 0.0), 1.0)
    rates[0] = speed
    rates[1] = force / q.mass_kg
    rates[2] = q.index / volume * (carried - lost - push * speed)
    rates[3] = inflow - leak


@njit(nogil=True, error_model="numpy", cache=True)
def all_rates(table, valve, time, state, leak, resistance, rates):  # type: ignore[no-untyped-def]
    """Of m instants (m, n) of n shots, states (m, n, k), with what hooks add (m, n), into (m, n,
    k)."""
    for m in range(time.shape[0]):
        for i in range(time.shape[1]):
            since, then, rate, _ = valve_motion(valve[i], time[m, i])
            _rates(
                table[i],
                since,
                then,
                rate,
                time[m, i],
                state[m, i],
                leak[m, i],
                resistance[m, i],
                rates[m, i],
            )


@njit(nogil=True, error_model="numpy")
def derivatives(q, since, position_then, rate, time, state, jacobian, by_time):  # type: ignore[no-untyped-def]
    """Of the six rates of a shot with a valve, by the state and by time."""
    position, velocity, pressure, mass = state[0], state[1], state[2], state[3]
    volume = q.volume_m3 + q.area_m2 * position
    absolute = pressure + q.zero_pa
    rt, varies = _gas_rt(absolute, volume, mass, q.outside_rt)
    rt_x = rt_p = rt_m = 0.0
    if varies:
        rt_x, rt_p, rt_m = absolute * q.area_m2 / mass, volume / mass, -rt / mass
    tank = state[4] + q.zero_pa
    tank_rt = tank * q.tank_m3 / state[5]
    tank_rt_p, tank_rt_m = q.tank_m3 / state[5], -tank_rt / state[5]
    share, opening = open_share(position_then + rate * (time - since))
    opening *= rate
    # Through the valve when wide open; its share comes in at once for all derivatives.
    flow, by_tank, by_behind, by_tank_rt, by_rt = _flow_derivatives(
        q.valve_m2, tank, tank_rt, absolute, rt, q.critical_ratio
    )
    flow_x, flow_m = by_rt * rt_x, by_rt * rt_m
    flow_p = by_behind + by_rt * rt_p
    flow_tp, flow_tm = by_tank + by_tank_rt * tank_rt_p, by_tank_rt * tank_rt_m
    if flow > 0:
        warmth, flow_t = tank_rt, opening * flow
        w_x, w_p, w_m = warmth * flow_x, warmth * flow_p, warmth * flow_m
        w_tp, w_tm = warmth * flow_tp + flow * tank_rt_p, warmth * flow_tm + flow * tank_rt_m
    else:
        warmth, flow_t = rt, opening * flow
        w_x, w_p, w_m = (
            warmth * flow_x + flow * rt_x,
            warmth * flow_p + flow * rt_p,
            warmth * flow_m + flow * rt_m,
        )
        w_tp, w_tm = warmth * flow_tp, warmth * flow_tm
    carried, w_t = share * warmth * flow, warmth * flow_t
    # Past the projectile.
    leak = leak_x = leak_p = leak_m = 0.0
    if q.leak_m2 > 0:
        leak, by_inside, _, by_inside_rt, _ = _flow_derivatives(
            q.leak_m2, absolute, rt, q.outside_pa, q.outside_rt, q.critical_ratio
        )
        leak_x, leak_p, leak_m = (
            by_inside_rt * rt_x,
            by_inside + by_inside_rt * rt_p,
            by_inside_rt * rt_m,
        )
    if q.gauge_leak_m2 > 0 and absolute > q.outside_pa:
        gauge = q.gauge_leak_m2 / math.sqrt(rt)
        above = absolute - q.outside_pa
        by_rt = -gauge * above / (2 * rt)
        leak += gauge * above
        leak_x, leak_p, leak_m = (
            leak_x + by_rt * rt_x,
            leak_p + gauge + by_rt * rt_p,
            leak_m + by_rt * rt_m,
        )
    if leak > 0:
        lost, lost_x, lost_p, lost_m = (
            rt * leak, rt * leak_x + leak * rt_x, rt * leak_p + leak * rt_p,
            rt * leak_m + leak * rt_m,
        )  # fmt: skip
    else:
        lost, lost_x, lost_p, lost_m = (
            q.outside_rt * leak, q.outside_rt * leak_x, q.outside_rt * leak_p,
            q.outside_rt * leak_m,
        )  # fmt: skip
    # Forces.
    area, speed = q.area_m2, max(velocity, 0.0)
    gauge = max(pressure, 0.0)
    density, dynamic = mass / volume, area * speed * speed / 2
    heads = q.wall_1_m * position * density + q.air_density_kg_m3 + q.gas_heads * gauge / rt
    push = pressure * area
    force = push - q.drag_n - heads * dynamic
    force_x = -dynamic * (
        q.wall_1_m * density * (1 - position * area / volume)
        - q.gas_heads * gauge / (rt * rt) * rt_x
    )
    force_v = -area * speed * heads
    force_p = (
        area - dynamic * q.gas_heads * ((1.0 if pressure > 0 else 0.0) - gauge / rt * rt_p) / rt
    )
    force_m = -dynamic * (q.wall_1_m * position / volume - q.gas_heads * gauge / (rt * rt) * rt_m)
    moves = 1.0 if velocity > 0 or (velocity == 0 and force > 0) else 0.0
    if force < 0:
        held = min(max(velocity / q.creep_m_s, 0.0), 1.0)
        rising = 1 / q.creep_m_s if 0 < velocity <= q.creep_m_s else 0.0
        force_x, force_p, force_m = force_x * held, force_p * held, force_m * held
        force_v = force_v * held + force * rising
    inverse_mass, factor, tank_factor = 1 / q.mass_kg, q.index / volume, -q.index / q.tank_m3
    gain = factor * (carried - lost - push * speed)
    jacobian[0, 0], jacobian[0, 1], jacobian[0, 2], jacobian[0, 3] = 0.0, moves, 0.0, 0.0
    jacobian[0, 4], jacobian[0, 5] = 0.0, 0.0
    jacobian[1, 0], jacobian[1, 1] = force_x * inverse_mass, force_v * inverse_mass
    jacobian[1, 2], jacobian[1, 3] = force_p * inverse_mass, force_m * inverse_mass
    jacobian[1, 4], jacobian[1, 5] = 0.0, 0.0
    jacobian[2, 0] = factor * (share * w_x - lost_x) - gain * area / volume
    jacobian[2, 1] = -factor * push * moves
    jacobian[2, 2] = factor * (share * w_p - lost_p - area * speed)
    jacobian[2, 3] = factor * (share * w_m - lost_m)
    jacobian[2, 4], jacobian[2, 5] = factor * share * w_tp, factor * share * w_tm
    jacobian[3, 0], jacobian[3, 1] = share * flow_x - leak_x, 0.0
    jacobian[3, 2], jacobian[3, 3] = share * flow_p - leak_p, share * flow_m - leak_m
    jacobian[3, 4], jacobian[3, 5] = share * flow_tp, share * flow_tm
    jacobian[4, 0], jacobian[4, 1] = tank_factor * share * w_x, 0.0
    jacobian[4, 2], jacobian[4, 3] = tank_factor * share * w_p, tank_factor * share * w_m
    jacobian[4, 4], jacobian[4, 5] = tank_factor * share * w_tp, tank_factor * share * w_tm
    jacobian[5, 0], jacobian[5, 1] = -share * flow_x, 0.0
    jacobian[5, 2], jacobian[5, 3] = -share * flow_p, -share * flow_m
    jacobian[5, 4], jacobian[5, 5] = -share * flow_tp, -share * flow_tm
    by_time[0], by_time[1], by_time[2], by_time[3] = 0.0, 0.0, factor * w_t, flow_t
    by_time[4], by_time[5] = tank_factor * w_t, -flow_t


@njit(nogil=True, error_model="numpy")
def _dormand_prince(q, time, state, first, step, work, new, slope, error):  # type: ignore[no-untyped-def]
    """One step of the four quantities of a shot without a valve."""
    for c in range(4):
        work[0, c] = first[c]
    for i in range(6):
        for c in range(4):
            total = 0.0
            for j in range(i + 1):
                total += _DP_STAGES[i, j] * work[j, c]
            new[c] = state[c] + step * total
        # Into an array that is at hand: a view of a row would have its references counted.
        _rates(q, 0.0, 1.0, 0.0, time + _DP_NODES[i] * step, new, 0.0, 0.0, slope)
        for c in range(4):
            work[i + 1, c] = slope[c]
    for c in range(4):
        total = 0.0
        for j in range(7):
            total += _DP_ERROR[j] * work[j, c]
        error[c] = total * step


@njit(nogil=True, error_model="numpy", fastmath={"contract"})
def _invert(system):  # type: ignore[no-untyped-def]
    """A 6 x 6 matrix in its place, by Gauss and Jordan.

    No pivots are looked for: 1 / (gamma step) on the diagonal leads, and a step for which it does
    not is refused.
    """
    for i in range(6):
        pivot = 1 / system[i, i]
        system[i, i] = 1.0
        for c in range(6):
            system[i, c] *= pivot
        for r in range(6):
            if r != i:
                factor = system[r, i]
                system[r, i] = 0.0
                for c in range(6):
                    system[r, c] -= factor * system[i, c]


@njit(nogil=True, error_model="numpy", fastmath={"contract"})
def _rodas_state(i, state, work, new):  # type: ignore[no-untyped-def]
    """Where stage `i` asks for the rates. Sums in names stay in registers."""
    n0, n1, n2, n3, n4, n5 = state[0], state[1], state[2], state[3], state[4], state[5]
    for j in range(i):
        a = _RODAS_STATE[i, j]
        n0, n1, n2 = n0 + a * work[j, 0], n1 + a * work[j, 1], n2 + a * work[j, 2]
        n3, n4, n5 = n3 + a * work[j, 3], n4 + a * work[j, 4], n5 + a * work[j, 5]
    new[0], new[1], new[2], new[3], new[4], new[5] = n0, n1, n2, n3, n4, n5


@njit(nogil=True, error_model="numpy", fastmath={"contract"})
def _rodas_stage(i, rates, step, per_step, inverse, by_time, work):  # type: ignore[no-untyped-def]
    """Stage `i` by the rates there."""
    s0 = s1 = s2 = s3 = s4 = s5 = 0.0
    for j in range(i):
        a = _RODAS_SIDE[i, j]
        s0, s1, s2 = s0 + a * work[j, 0], s1 + a * work[j, 1], s2 + a * work[j, 2]
        s3, s4, s5 = s3 + a * work[j, 3], s4 + a * work[j, 4], s5 + a * work[j, 5]
    late = _RODAS_TIMES[i] * step
    s0, s1 = rates[0] + s0 * per_step, rates[1] + s1 * per_step
    s2, s3 = (
        rates[2] + s2 * per_step + late * by_time[2],
        rates[3] + s3 * per_step + late * by_time[3],
    )
    s4, s5 = (
        rates[4] + s4 * per_step + late * by_time[4],
        rates[5] + s5 * per_step + late * by_time[5],
    )
    for c in range(6):
        work[i, c] = (
            inverse[0, c] * s0 + inverse[1, c] * s1 + inverse[2, c] * s2
            + inverse[3, c] * s3 + inverse[4, c] * s4 + inverse[5, c] * s5
        )  # fmt: skip


@njit(nogil=True, error_model="numpy", fastmath={"contract"})
def _rodas(  # type: ignore[no-untyped-def]
    q, since, then, speed, time, state, first, step, work, system, by_time, new, slope, error
):
    """One step of the six quantities of a shot with a valve."""
    derivatives(q, since, then, speed, time, state, system, by_time)
    diagonal, per_step = 1 / (GAMMA * step), 1 / step
    # Transposed, so that columns of the inverse lie together.
    for r in range(6):
        for c in range(r):
            system[r, c], system[c, r] = -system[c, r], -system[r, c]
        system[r, r] = diagonal - system[r, r]
    _invert(system)
    for c in range(6):
        slope[c] = first[c]
    for i in range(8):
        if i > 0:
            _rodas_state(i, state, work, new)
            _rates(q, since, then, speed, time + _RODAS_NODES[i] * step, new, 0.0, 0.0, slope)
        _rodas_stage(i, slope, step, per_step, system, by_time, work)
    for c in range(6):
        error[c] = work[7, c]
        new[c] += work[7, c]
    _rates(q, since, then, speed, time + step, new, 0.0, 0.0, slope)


@njit(nogil=True, error_model="numpy")
def _aimed(step, start, rate, end, end_rate, target):  # type: ignore[no-untyped-def]
    """The step after which position is at its target, by the cubic through both ends of a longer
    one."""
    rise, r0, r1 = end - start, step * rate, step * end_rate
    s = straight = (target - start) / rise
    bend, twist = 3 * rise - 2 * r0 - r1, r0 + r1 - 2 * rise
    for _ in range(4):
        value = s * (r0 + s * (bend + s * twist))
        slope = r0 + s * (2 * bend + 3 * s * twist)
        s = min(max(s + (target - start - value) / (slope if slope > 0 else rise), 0.01), 1.0)
    # A cubic that turns back may lead to the end again, and would do so for ever.
    return step * (s if s < 1 else straight)


#: Position and velocity, which every shot has, and where the tank's pressure is among them without
#: and with a valve.
_POSITION, _VELOCITY, _ONE_GAS, _TANK = 0, 1, 2, 4


@njit(nogil=True, error_model="numpy")
def _remember(history, count, time, state, rates, tank):  # type: ignore[no-untyped-def]
    """Where step `count` begins, into its row of the history, a ring: time, tank pressure,
    position, velocity, and the rates of these three."""
    row = count % history.shape[0]
    history[row, 0] = time
    history[row, 1], history[row, 4] = state[tank], rates[tank]
    history[row, 2], history[row, 5] = state[_POSITION], rates[_POSITION]
    history[row, 3], history[row, 6] = state[_VELOCITY], rates[_VELOCITY]


@njit(nogil=True, error_model="numpy")
def _earlier_states(history, count, leads, earlier):  # type: ignore[no-untyped-def]
    """Tank pressure, position and velocity at moments `leads` (m,) before the last of `count` rows
    of `history`, a ring, into (m, 3): cubics between the rows. What is before the first of them is
    as it."""
    size = history.shape[0]
    last = min(count, size) - 1
    end = history[(count - 1) % size, 0]
    for m in range(leads.size):
        moment = end - leads[m]
        back = 1
        while back < last and history[(count - 1 - back) % size, 0] > moment:
            back += 1
        first, second = (count - 1 - back) % size, (count - back) % size
        width = history[second, 0] - history[first, 0]
        share = min(max((moment - history[first, 0]) / width, 0.0), 1.0) if width > 0 else 1.0
        rest = 1 - share
        for c in range(3):
            value = (
                rest * rest * (1 + 2 * share) * history[first, 1 + c]
                + share * share * (3 - 2 * share) * history[second, 1 + c]
            )
            earlier[m, c] = value + share * rest * width * (
                rest * history[first, 4 + c] - share * history[second, 4 + c]
            )


@njit(nogil=True, error_model="numpy")
def _moved(  # type: ignore[no-untyped-def]
    q, valve, state, step, floor, relative, most_steps, work, system, by_time, new, slope, first,
    error, leads, history, earlier,
):  # fmt: skip
    """One shot to its end, its state in its place: time, and how it ended; what was at `leads`
    before it (m, 3)."""
    k, time, aims = state.size, 0.0, False
    tank, count, remembers = (_TANK if k == 6 else _ONE_GAS), 0, leads.size > 0
    since, then, speed, corner = valve_motion(valve, time)
    _rates(q, since, then, speed, time, state, 0.0, 0.0, first)
    for _ in range(most_steps):
        # No step passes a corner of the valve's way, or the whole of a short opening.
        at_corner = corner <= time + step
        if at_corner:
            step = corner - time
        if k == 6:
            _rodas(
                q,
                since,
                then,
                speed,
                time,
                state,
                first,
                step,
                work,
                system,
                by_time,
                new,
                slope,
                error,
            )
        else:
            _dormand_prince(q, time, state, first, step, work, new, slope, error)
        total, finite = 0.0, True
        for c in range(k):
            share = error[c] / max(abs(new[c]), floor[c])
            total += share * share
            finite = finite and math.isfinite(slope[c])
        ratio = math.sqrt(total / k) / relative if finite else math.inf
        growth = 0.2
        if ratio == 0:
            growth = 5.0
        elif ratio < math.inf:
            growth = min(max(0.9 * ratio**-0.2, 0.2), 5.0)
        if not ratio <= 1:  # or not a number
            step *= growth
        else:
            gap = new[0] - q.travel_m
            if abs(gap) <= AT_TARGET * q.travel_m:
                late = gap / slope[0]
                if remembers:
                    _remember(history, count, time, state, first, tank)
                for c in range(k):
                    state[c] = new[c] - late * slope[c]
                if remembers:
                    _remember(history, count + 1, time + step - late, state, slope, tank)
                    _earlier_states(history, count + 2, leads, earlier)
                return time + step - late, REACHED
            if gap > 0:
                step, aims = _aimed(step, state[0], first[0], new[0], slope[0], q.travel_m), True
            else:
                if remembers:
                    _remember(history, count, time, state, first, tank)
                    count += 1
                time += step
                if at_corner:
                    time = corner
                    since, then, speed, corner = valve_motion(valve, time)
                step = -gap / slope[0] if aims and slope[0] > 0 else step * growth
                for c in range(k):
                    state[c], first[c] = new[c], slope[c]
                # What a step overshoots as friction stops the projectile; the rates at rest are the
                # same.
                state[1] = max(state[1], 0.0)
        most = max(state[2], state[4]) if k == 6 else state[2]
        if time > q.patience_s or (state[1] < q.creep_m_s and most * q.area_m2 <= q.drag_n):
            return time, GIVEN_UP
    return time, TOO_MANY_STEPS


@njit(nogil=True, error_model="numpy", cache=True)
def run_all(  # type: ignore[no-untyped-def]
    table, valve, states, steps, floors, relative, most_steps, times, ends, leads, earlier
):
    """Shots (n,) one after the other from `states` (n, 4 or 6) to their ends, in their place:
    times, and how each ended. `steps` are tried first; `floors` (n, k) are as in
    `ode.StepTolerance`. `earlier` (n, m, 3): the law's tank pressure, position and velocity at
    `leads` (n, m) before the end of a shot that reaches it.

    Ends with the first shot that takes too many steps.
    """
    k = states.shape[1]
    work, system, by_time = np.empty((8, k)), np.empty((6, 6)), np.empty(6)
    new, slope, first, error = np.empty(k), np.empty(k), np.empty(k), np.empty(k)
    history = np.empty((_REMEMBERED_STEPS if leads.shape[1] else 1, 7))
    for i in range(times.size):
        times[i], ends[i] = _moved(
            table[i], valve[i], states[i], steps[i], floors[i], relative, most_steps,
            work, system, by_time, new, slope, first, error, leads[i], history, earlier[i],
        )  # fmt: skip
        if ends[i] == TOO_MANY_STEPS:
            break
