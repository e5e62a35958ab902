"""The compiled motion of contacts in their own units: symbols as in `integrate_contact.py`.

x = xi + beta ln(1 + h f) / h; x' = eta - lambda phi; phi = f (1 + a x'); eta' = -phi. The loss acts
on the rate of the whole approach, so that x' = (eta - lambda f) / (1 + a lambda f) is explicit.

Steps are those of the classical Runge-Kutta method of order 4, equal in s with t = T s^q, T each
contact's own time. Force begins as t^p, and below a layer indentation as t^(1/p): with q = 2 and q
= 2 p both are smooth in s, which they are not in t. Where the bodies are about to part freely, the
last steps are in sigma with xi - xi_0 = d (1 - sigma)^2: the end is met exactly, and the force is
smooth in sigma as it was in s.

Contacts go side by side, so that a processor need not wait for one's root before it begins the next
one's. The few steps that are each contact's own, to the depth of yield and to the turn, are done
one by one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

#: Most steps of the loading, and of the unloading, in those of a contact's own time.
_LONGEST = 1000
#: Least steps in the time sqrt(d / F) in which a contact springs back.
_RECOIL_STEPS = 6
#: Bodies part freely when the rate of approach will change by less than this share on the way that
#: is left.
_FREE = 0.3
#: Largest stiffness times way left for which the steps of the landing are short enough.
_STIFF = 2.0
#: Change of the rate of approach, relative, that is none.
_NEXT_TO_NOTHING = 1e-7
#: Below, a logarithm over its argument is its first two terms.
_LINEAR = 1e-8
_CLOSER = 5  # steps of regula falsi: to the last digits
_ANOTHER_STEP, _LANDING, _DRIFTING, _TOUCHING = 0, 1, 2, 3
#: The stages of a step: where each lies in it, how much it weighs, and how far the next one lies
#: along its rates.
_AT, _WEIGHTS, _ON = (0.0, 0.5, 0.5, 1.0), (1.0, 2.0, 2.0, 1.0), (0.5, 0.5, 1.0, 1.0)
#: Contacts side by side, and what a table holds of each, a row for each quantity.
_WIDTH = 64
# fmt: off
(_P, _A, _LAMBDA, _BETA, _H, _YIELD, _R, _T, _Q, _C, _REST, _CONTACT, _LEAST,
# what it is, first its figures
 _S, _DEPTH, _VELOCITY, _OLD_S, _OLD_DEPTH, _OLD_VELOCITY, _ELASTIC, _TIME,
 # where it is, and was a step before
 _AT_DEPTH, _AT_VELOCITY, _ROOT, _STATIC, _SLOPE, _GRIP, _LOSSY, _APPROACH, _INDENTATION, _FORCE,
 # its rates there
 _SLOW, _BEGIN, _HALF, _END, _SUM_DEPTH, _SUM_VELOCITY, _ROWS) = range(0, 38 * _WIDTH,
 _WIDTH)  # and its step
# fmt: on


class Law(NamedTuple):
    """f = c (xi - xi_0)^p up to the depth of yield, from there on with hardening; and what acts
    beside it.

    Beyond the depth xi_y f = f_y (1 + p ((xi / xi_y)^r - 1) / r): its tangent there for r = 1,
    elastic for r = p.
    """

    exponent: float  # p
    factor: float  # c
    rest: float  # xi_0: the indentation that stays
    yield_depth: float
    damping: float  # a
    inelasticity: float  # lambda
    compliance: float  # beta
    stiffening: float  # h
    hardening: float = 1.0  # r


class Rates(NamedTuple):
    """How a motion goes on from one state."""

    force: float  # phi
    indentation: float  # d xi / dt
    approach: float  # dx / dt
    approach_rate: float  # d2x / dt2
    force_rate: float
    static: float  # f
    slope: float  # df / d xi


@njit(cache=True, nogil=True, error_model="numpy")
def hardening_curve(relative_depth, hardening):  # type: ignore[no-untyped-def]
    """(z^r - 1) / r and its slope z^(r - 1), of the indentation over that of yield."""
    exponential = math.expm1(hardening * math.log(relative_depth))
    return exponential / hardening, (1.0 + exponential) / relative_depth


@njit(cache=True, nogil=True, error_model="numpy")
def spring(law, depth):  # type: ignore[no-untyped-def]
    """f and its slope."""
    over = depth - law.rest
    if over < 0.0:  # not max(), which would take a number for what is none
        over = 0.0
    elastic = law.yield_depth if over > law.yield_depth else over
    root = law.factor * (
        math.sqrt(elastic) if law.exponent == 1.5 else elastic ** (law.exponent - 1.0)
    )
    slope = law.exponent * root
    if law.hardening != 1.0 and over > elastic:
        beyond, steeper = hardening_curve(over / elastic, law.hardening)
        return elastic * root + slope * elastic * beyond, slope * steeper
    return elastic * root + slope * (over - elastic), slope


@njit(cache=True, nogil=True, error_model="numpy")
def layer(law, static):  # type: ignore[no-untyped-def]
    """By how much the layer gives way under f: beta ln(1 + h f) / h."""
    stiffer = law.stiffening * static
    share = math.log1p(stiffer) / stiffer if stiffer > _LINEAR else 1.0 - stiffer / 2
    return law.compliance * static * share


@njit(nogil=True, error_model="numpy")
def _pace(law, depth, velocity):  # type: ignore[no-untyped-def]
    """What a step needs of a state, phi and d xi / dt; and of what they are made: dx / dt, f, df /
    d xi, 1 + a x' and 1 + a lambda f."""
    static, slope = spring(law, depth)
    zener = law.inelasticity * static
    lossy = 1.0 + law.damping * zener
    approach = (velocity - zener) / lossy
    grip = 1.0 + law.damping * approach
    layered = 1.0
    if law.compliance > 0.0:
        layered += law.compliance / (1.0 + law.stiffening * static) * slope
    return static * grip, approach / layered, approach, static, slope, grip, lossy


@njit(cache=True, nogil=True, error_model="numpy")
def rates(law, depth, velocity):  # type: ignore[no-untyped-def]
    """`Rates` of a state."""
    force, indentation, approach, static, slope, grip, lossy = _pace(law, depth, velocity)
    gripped = slope * indentation * grip
    approach_rate = -(force + law.inelasticity * gripped) / lossy
    force_rate = gripped + law.damping * static * approach_rate
    return Rates(force, indentation, approach, approach_rate, force_rate, static, slope)


@njit(nogil=True, error_model="numpy")
def _raised(s, power):  # type: ignore[no-untyped-def]
    """s^(q - 1); q is 2, and 3 for spheres on a layer."""
    if power == 2.0:
        return s
    return s * s if power == 3.0 else s ** (power - 1.0)


@njit(nogil=True, error_model="numpy")
def _step(law, own_time, power, s, size, depth, velocity, now):  # type: ignore[no-untyped-def]
    """Indentation and velocity after one step of s; `now` are the rates at its begin."""
    unit, half = own_time * power, 0.5 * size
    slow = unit * _raised(s, power)  # dt / ds
    d1, v1 = slow * now.indentation, -slow * now.force
    slow = unit * _raised(s + half, power)
    force, indentation, _, _, _, _, _ = _pace(law, depth + half * d1, velocity + half * v1)
    d2, v2 = slow * indentation, -slow * force
    force, indentation, _, _, _, _, _ = _pace(law, depth + half * d2, velocity + half * v2)
    d3, v3 = slow * indentation, -slow * force
    slow = unit * _raised(s + size, power)
    force, indentation, _, _, _, _, _ = _pace(law, depth + size * d3, velocity + size * v3)
    d4, v4 = slow * indentation, -slow * force
    sixth = size / 6
    return depth + sixth * (d1 + 2 * (d2 + d3) + d4), velocity + sixth * (v1 + 2 * (v2 + v3) + v4)


@njit(nogil=True, error_model="numpy")
def to_the_yield(law, own_time, power, s, size, depth, velocity):  # type: ignore[no-untyped-def]
    """s, indentation and velocity at the depth of yield, which the next step passes: the force's
    slope has a kink.

    The part of the step is found by regula falsi, the Illinois way: Newton's fails where the turn
    is near.
    """
    elastic = Law(
        law.exponent,
        law.factor,
        law.rest,
        np.inf,
        law.damping,
        law.inelasticity,
        law.compliance,
        law.stiffening,
        1.0,
    )
    now = rates(elastic, depth, velocity)
    low, high, below = 0.0, size, depth - law.yield_depth
    above = _step(elastic, own_time, power, s, size, depth, velocity, now)[0] - law.yield_depth
    part, there, fast, last = 0.0, depth, velocity, -1
    for _ in range(_CLOSER):
        part = (low * above - high * below) / (above - below) if above > below else low
        there, fast = _step(elastic, own_time, power, s, part, depth, velocity, now)
        off = there - law.yield_depth
        short = 1 if off < 0 else 0
        half = 0.5 if short == last else 1.0  # for the end that stays where it is once more
        if short:
            low, below, above = part, off, half * above
        else:
            high, below, above = part, half * below, off
        last = short
    return s + part, there, fast


@njit(nogil=True, error_model="numpy")
def _to_the_turn(law, time, depth, velocity):  # type: ignore[no-untyped-def]
    """Time, indentation, velocity where the approach ends, in one step of its rate: Henon, Physica
    D 5 (1982) 412."""
    now = rates(law, depth, velocity)
    size = -now.approach
    half, t1 = 0.5 * size, 1.0 / now.approach_rate
    d1, v1 = now.indentation * t1, -now.force * t1
    now = rates(law, depth + half * d1, velocity + half * v1)
    t2 = 1.0 / now.approach_rate
    d2, v2 = now.indentation * t2, -now.force * t2
    now = rates(law, depth + half * d2, velocity + half * v2)
    t3 = 1.0 / now.approach_rate
    d3, v3 = now.indentation * t3, -now.force * t3
    now = rates(law, depth + size * d3, velocity + size * v3)
    t4 = 1.0 / now.approach_rate
    d4, v4 = now.indentation * t4, -now.force * t4
    sixth = size / 6
    return (
        time + sixth * (t1 + 2 * (t2 + t3) + t4),
        depth + sixth * (d1 + 2 * (d2 + d3) + d4),
        velocity + sixth * (v1 + 2 * (v2 + v3) + v4),
    )


@njit(cache=True, nogil=True, error_model="numpy")
def unloading(law, deepest):  # type: ignore[no-untyped-def]
    """The law from the deepest indentation of the loading on, eq. 1.17.

    Thornton lets the flattened sphere unload as a Hertzian one of larger radius R_p = R F_e /
    F_max, F_e the force that the deepest indentation would have taken without yield; with p = 3/2,
    delta_max - delta_p = delta_max F_max / F_e. F_max is the force of the loading there, with its
    hardening. Source: Thornton, J. Appl. Mech. 64 (1997) 383.
    """
    factor, rest = 1.0, 0.0
    if deepest > law.yield_depth:
        force, _ = spring(law, deepest)
        recovered = deepest * force / deepest**law.exponent
        factor, rest = force / recovered**law.exponent, deepest - recovered
    return Law(
        law.exponent,
        factor,
        rest,
        np.inf,
        law.damping,
        law.inelasticity,
        law.compliance,
        law.stiffening,
        1.0,
    )


@njit(nogil=True, error_model="numpy")
def _left(law, depth, static):  # type: ignore[no-untyped-def]
    """Way until the bodies part."""
    return depth - law.rest + layer(law, static)


@njit(nogil=True, error_model="numpy")
def _ending(law, depth, now, least):  # type: ignore[no-untyped-def]
    """How an unloading goes on."""
    speed, depth_to_separation = -now.approach, _left(law, depth, now.static)
    stiffness = law.damping * now.static + law.inelasticity * now.slope
    change = abs(now.approach_rate) * depth_to_separation
    steady = speed > 0 and change < _FREE * speed**2
    if steady and stiffness * depth_to_separation < _STIFF * speed:
        return _LANDING
    if speed > 0 and max(change, now.force * depth_to_separation) < _NEXT_TO_NOTHING * speed**2:
        return _DRIFTING
    return _TOUCHING if not steady and now.force < least else _ANOTHER_STEP


@njit(nogil=True, error_model="numpy")
def _law(w, i):  # type: ignore[no-untyped-def]
    """Of one contact of the table."""
    return Law(
        w[_P + i],
        w[_C + i],
        w[_REST + i],
        w[_YIELD + i],
        w[_A + i],
        w[_LAMBDA + i],
        w[_BETA + i],
        w[_H + i],
        w[_R + i],
    )


@njit(nogil=True, error_model="numpy")
def _rates_of(w, i):  # type: ignore[no-untyped-def]
    """`rates`, from what `_pace_all` left of one contact."""
    gripped = w[_SLOPE + i] * w[_INDENTATION + i] * w[_GRIP + i]
    approach_rate = -(w[_FORCE + i] + w[_LAMBDA + i] * gripped) / w[_LOSSY + i]
    force_rate = gripped + w[_A + i] * w[_STATIC + i] * approach_rate
    return Rates(
        w[_FORCE + i],
        w[_INDENTATION + i],
        w[_APPROACH + i],
        approach_rate,
        force_rate,
        w[_STATIC + i],
        w[_SLOPE + i],
    )


@njit(nogil=True, error_model="numpy")
def _pace_all(w, n):  # type: ignore[no-untyped-def]
    """`_pace` of the first n contacts at `_AT_DEPTH` and `_AT_VELOCITY`."""
    spheres = tangents = True
    for i in range(n):
        over = w[_AT_DEPTH + i] - w[_REST + i]
        over = 0.0 if over < 0.0 else over
        elastic = w[_YIELD + i] if over > w[_YIELD + i] else over
        w[_STATIC + i], w[_SLOPE + i] = over, elastic
        w[_ROOT + i] = math.sqrt(elastic)
    for i in range(n):
        spheres = spheres and w[_P + i] == 1.5
        tangents = tangents and w[_R + i] == 1.0
    if not spheres:
        for i in range(n):
            if w[_P + i] != 1.5:
                w[_ROOT + i] = w[_SLOPE + i] ** (w[_P + i] - 1.0)
    if not tangents:
        # The tangent to the force at this depth is as far from its own zero as the force over its
        # slope is long.
        for i in range(n):
            elastic, over = w[_SLOPE + i], w[_STATIC + i]
            if w[_R + i] != 1.0 and over > elastic:
                beyond, steeper = hardening_curve(over / elastic, w[_R + i])
                w[_SLOPE + i], w[_STATIC + i] = 0.0, elastic * (1.0 / w[_P + i] + beyond) / steeper
                w[_ROOT + i] *= steeper
    for i in range(n):
        over, elastic, root = w[_STATIC + i], w[_SLOPE + i], w[_C + i] * w[_ROOT + i]
        slope = w[_P + i] * root
        static = elastic * root + slope * (over - elastic)
        zener = w[_LAMBDA + i] * static
        lossy = 1.0 + w[_A + i] * zener
        approach = (w[_AT_VELOCITY + i] - zener) / lossy
        grip = 1.0 + w[_A + i] * approach
        layered = 1.0 + w[_BETA + i] / (1.0 + w[_H + i] * static) * slope
        w[_STATIC + i], w[_SLOPE + i], w[_GRIP + i], w[_LOSSY + i] = static, slope, grip, lossy
        w[_APPROACH + i], w[_INDENTATION + i], w[_FORCE + i] = (
            approach,
            approach / layered,
            static * grip,
        )


@njit(nogil=True, error_model="numpy")
def _step_all(w, n, size):  # type: ignore[no-untyped-def]
    """The first n contacts on by one step of s; their rates at its begin are known."""
    for i in range(n):
        unit, power, s = w[_T + i] * w[_Q + i], w[_Q + i], w[_S + i]
        w[_BEGIN + i] = unit * _raised(s, power)
        w[_HALF + i] = unit * _raised(s + 0.5 * size, power)
        w[_END + i] = unit * _raised(s + size, power)
        w[_OLD_S + i], w[_OLD_DEPTH + i], w[_OLD_VELOCITY + i] = s, w[_DEPTH + i], w[_VELOCITY + i]
        w[_S + i] = s + size
        w[_SUM_DEPTH + i] = w[_SUM_VELOCITY + i] = 0.0
    for stage in range(4):
        if stage > 0:
            _pace_all(w, n)
        row, weight, on = (_BEGIN, _HALF, _HALF, _END)[stage], _WEIGHTS[stage], size * _ON[stage]
        for i in range(n):
            w[_SLOW + i] = w[row + i]  # dt / ds
        for i in range(n):
            depth_rate, velocity_rate = (
                w[_SLOW + i] * w[_INDENTATION + i],
                -w[_SLOW + i] * w[_FORCE + i],
            )
            w[_SUM_DEPTH + i] += weight * depth_rate
            w[_SUM_VELOCITY + i] += weight * velocity_rate
            w[_AT_DEPTH + i] = w[_DEPTH + i] + on * depth_rate
            w[_AT_VELOCITY + i] = w[_VELOCITY + i] + on * velocity_rate
    for i in range(n):
        w[_DEPTH + i] += size / 6 * w[_SUM_DEPTH + i]
        w[_VELOCITY + i] += size / 6 * w[_SUM_VELOCITY + i]


@njit(nogil=True, error_model="numpy")
def _pace_here(w, n):  # type: ignore[no-untyped-def]
    for i in range(n):
        w[_AT_DEPTH + i], w[_AT_VELOCITY + i] = w[_DEPTH + i], w[_VELOCITY + i]
    _pace_all(w, n)


@njit(nogil=True, error_model="numpy")
def _swap(w, i, k):  # type: ignore[no-untyped-def]
    """Contacts i and k of the table."""
    for row in range(0, _ROWS, _WIDTH):
        w[row + i], w[row + k] = w[row + k], w[row + i]


@njit(nogil=True, error_model="numpy")
def with_room(nodes, count, more):  # type: ignore[no-untyped-def]
    """`nodes` where `more` fit behind the first `count`, else a larger table with these."""
    if count + more <= len(nodes):
        return nodes
    larger = np.empty((2 * (count + more), nodes.shape[1]))
    for k in range(count):  # a slice takes a second longer to compile
        for j in range(nodes.shape[1]):
            larger[k, j] = nodes[k, j]
    return larger


@njit(nogil=True, error_model="numpy")
def noted(nodes, count, contact, time, force, force_rate):  # type: ignore[no-untyped-def]
    """A node more; how many there are."""
    nodes[count, 0], nodes[count, 1], nodes[count, 2], nodes[count, 3] = (
        contact,
        time,
        force,
        force_rate,
    )
    return count + 1


@njit(nogil=True, error_model="numpy")
def _load(w, n, steps, nodes, count):  # type: ignore[no-untyped-def]
    """n contacts from the touch to the deepest indentation, at `_TIME`: how many fail, the nodes,
    how many those are.

    Those that are there go behind the others.
    """
    size = 1.0 / steps
    for _ in range(_LONGEST * steps + 1):
        _pace_here(w, n)
        nodes = with_room(nodes, count, n)
        for i in range(n - 1, -1, -1):
            if w[_APPROACH + i] <= 0:
                s = w[_OLD_S + i]
                w[_TIME + i], w[_DEPTH + i], w[_VELOCITY + i] = _to_the_turn(
                    _law(w, i),
                    w[_T + i] * _raised(s, w[_Q + i]) * s,
                    w[_OLD_DEPTH + i],
                    w[_OLD_VELOCITY + i],
                )
                n -= 1
                _swap(w, i, n)
            else:
                time, now = w[_T + i] * _raised(w[_S + i], w[_Q + i]) * w[_S + i], _rates_of(w, i)
                count = noted(nodes, count, w[_CONTACT + i], time, now.force, now.force_rate)
        if n == 0:
            break
        _step_all(w, n, size)
        for i in range(n):
            reach = w[_YIELD + i]
            if w[_ELASTIC + i] == 1.0 and w[_OLD_DEPTH + i] < reach and w[_DEPTH + i] > reach:
                # The step that crosses the depth of yield is done in two parts.
                law, end = _law(w, i), w[_S + i]
                s, depth, velocity = to_the_yield(
                    law,
                    w[_T + i],
                    w[_Q + i],
                    w[_OLD_S + i],
                    size,
                    w[_OLD_DEPTH + i],
                    w[_OLD_VELOCITY + i],
                )
                w[_OLD_S + i], w[_OLD_DEPTH + i], w[_OLD_VELOCITY + i], w[_ELASTIC + i] = (
                    s,
                    depth,
                    velocity,
                    0.0,
                )
                now = rates(law, depth, velocity)
                w[_DEPTH + i], w[_VELOCITY + i] = _step(
                    law, w[_T + i], w[_Q + i], s, end - s, depth, velocity, now
                )
    return n, nodes, count


@njit(nogil=True, error_model="numpy")
def _unload(w, n, steps, nodes, count):  # type: ignore[no-untyped-def]
    """The same from the deepest indentation to the end, or to where the landing begins; `_ELASTIC`
    is how it ends."""
    size = 1.0 / steps
    for _ in range(_LONGEST * steps):
        _pace_here(w, n)
        nodes = with_room(nodes, count, 2 * n)
        for i in range(n - 1, -1, -1):
            law, now = _law(w, i), _rates_of(w, i)
            time = w[_T + i] * _raised(w[_S + i], w[_Q + i]) * w[_S + i]
            count = noted(nodes, count, w[_CONTACT + i], time, now.force, now.force_rate)
            how = _ending(law, w[_DEPTH + i], now, w[_LEAST + i])
            if how == _ANOTHER_STEP:
                continue
            if how == _DRIFTING:
                # Next to no force is left: they part with the velocity that they have.
                time -= _left(law, w[_DEPTH + i], now.static) / now.approach
                count = noted(nodes, count, w[_CONTACT + i], time, 0.0, 0.0)
            elif how == _TOUCHING and now.force > 0 and now.force_rate < 0:
                # The last step went a little beyond the least force, which falls as an exponential.
                # A force that has come down to nothing has no exponential to go back along.
                time += math.log(w[_LEAST + i] / now.force) * now.force / now.force_rate
            w[_TIME + i], w[_ELASTIC + i] = time, how
            n -= 1
            _swap(w, i, n)
        if n == 0:
            break
        _step_all(w, n, size)
    return n, nodes, count


@njit(nogil=True, error_model="numpy")
def _land(w, n, steps, nodes, count):  # type: ignore[no-untyped-def]
    """The first n contacts in steps of the way left, to the end of it."""
    landing = max(steps // 3, 1)
    size = 1.0 / landing
    nodes = with_room(nodes, count, landing * n)
    for i in range(n):
        w[_OLD_DEPTH + i] = w[_DEPTH + i] - w[_REST + i]
    for k in range(landing):
        sigma = k * size
        for i in range(n):
            w[_SUM_DEPTH + i] = w[_SUM_VELOCITY + i] = 0.0
            w[_AT_DEPTH + i] = w[_REST + i] + w[_OLD_DEPTH + i] * (1 - sigma) ** 2
            w[_AT_VELOCITY + i] = w[_VELOCITY + i]
        for stage in range(4):
            share, following = 1 - (sigma + size * _AT[stage]), 1 - (sigma + size * _ON[stage])
            weight, on = _WEIGHTS[stage], size * _ON[stage]
            _pace_all(w, n)
            for i in range(n):
                slowness = -2 * w[_OLD_DEPTH + i] * share / w[_INDENTATION + i]
                velocity_rate = -w[_FORCE + i] * slowness
                w[_SUM_DEPTH + i] += weight * slowness
                w[_SUM_VELOCITY + i] += weight * velocity_rate
                w[_AT_DEPTH + i] = w[_REST + i] + w[_OLD_DEPTH + i] * following**2
                w[_AT_VELOCITY + i] = w[_VELOCITY + i] + on * velocity_rate
        for i in range(n):
            w[_TIME + i] += size / 6 * w[_SUM_DEPTH + i]
            w[_VELOCITY + i] += size / 6 * w[_SUM_VELOCITY + i]
            w[_AT_DEPTH + i] = w[_REST + i] + w[_OLD_DEPTH + i] * (1 - sigma - size) ** 2
            w[_AT_VELOCITY + i] = w[_VELOCITY + i]
        _pace_all(w, n)
        for i in range(n):
            now = _rates_of(w, i)
            count = noted(nodes, count, w[_CONTACT + i], w[_TIME + i], now.force, now.force_rate)
    return nodes, count


@njit(cache=True, nogil=True)
def by_contact(nodes, n):  # type: ignore[no-untyped-def]
    """Where each contact's nodes begin, and all nodes (3, k) in that order."""
    first, places = np.zeros(n + 1, dtype=np.intp), np.empty(n, dtype=np.intp)
    for k in range(len(nodes)):
        first[np.intp(nodes[k, 0]) + 1] += 1
    for i in range(n):
        places[i] = first[i]
        first[i + 1] += first[i]
    ordered = np.empty((3, len(nodes)))
    for k in range(len(nodes)):
        contact = np.intp(nodes[k, 0])
        for column in range(3):
            ordered[column, places[contact]] = nodes[k, 1 + column]
        places[contact] += 1
    return first, ordered


@njit(nogil=True, error_model="numpy")
def _shorten_steps(w, i, law, size):  # type: ignore[no-untyped-def]
    """Steps from the turn on that resolve the recoil, where what springs back is far shorter than
    what was pressed in.

    A mass of 1 comes back the way d from rest under a force F in about sqrt(d / F).
    """
    now = rates(law, w[_DEPTH + i], 0.0)
    recoil = math.sqrt(max(_left(law, w[_DEPTH + i], now.static), 0.0) / now.force)
    shortest = w[_Q + i] * w[_TIME + i] * size * _RECOIL_STEPS
    if recoil > 0 and shortest > recoil * w[_S + i]:
        w[_S + i] = shortest / recoil
        w[_T + i] = w[_TIME + i] / w[_S + i] ** w[_Q + i]


@njit(cache=True, nogil=True, error_model="numpy")
def march(figures, steps, least_share):  # type: ignore[no-untyped-def]
    """Contacts of `figures` (n, 9): the columns of `Numbers`, T and q.

    Returns what was found (6, n): contact time, compression time, deepest and permanent
    indentation, velocity at the end and whether they parted; the numbers of those that did not turn
    and that did not end; and the nodes (3, k), time and force and its rate, those of contact i from
    `first[i]` to `first[i + 1]`.
    """
    n, unturned, endless = len(figures), 0, 0
    # A plain 0 would be a type of its own, for which all that it goes to is compiled once more.
    count, nobody = np.intp(0), np.intp(0)
    outcomes, w = np.empty((6, n)), np.empty(_ROWS)
    nodes = np.empty((2 * steps * n + 2 * _WIDTH, 4))
    for start in range(0, n, _WIDTH):
        some = min(_WIDTH, n - start)
        for i in range(some):
            for k in range(figures.shape[1]):
                w[k * _WIDTH + i] = figures[start + i, k]
            w[_C + i], w[_REST + i], w[_S + i], w[_DEPTH + i], w[_VELOCITY + i] = (
                1.0,
                0.0,
                0.0,
                0.0,
                1.0,
            )
            w[_ELASTIC + i], w[_CONTACT + i] = 1.0, start + i
        failed, nodes, count = _load(w, some, steps, nodes, count)
        unturned += failed
        if failed:
            continue
        for i in range(some):
            contact = np.intp(w[_CONTACT + i])
            law = unloading(_law(w, i), w[_DEPTH + i])
            w[_C + i], w[_REST + i], w[_YIELD + i], w[_R + i] = law.factor, law.rest, np.inf, 1.0
            w[_LEAST + i] = least_share * rates(law, w[_DEPTH + i], w[_VELOCITY + i]).force
            w[_S + i] = (w[_TIME + i] / w[_T + i]) ** (1.0 / w[_Q + i])
            _shorten_steps(w, i, law, 1.0 / steps)
            outcomes[1, contact], outcomes[2, contact], outcomes[3, contact] = (
                w[_TIME + i],
                w[_DEPTH + i],
                law.rest,
            )
        failed, nodes, count = _unload(w, some, steps, nodes, count)
        endless += failed
        if failed:
            continue
        landing = nobody
        for i in range(some):
            if w[_ELASTIC + i] == _LANDING:
                _swap(w, i, landing)
                landing += 1
        nodes, count = _land(w, landing, steps, nodes, count)
        for i in range(some):
            contact = np.intp(w[_CONTACT + i])
            outcomes[0, contact], outcomes[4, contact], outcomes[5, contact] = (
                w[_TIME + i],
                w[_VELOCITY + i],
                (0.0 if w[_ELASTIC + i] == _TOUCHING else 1.0),
            )
    first, ordered = by_contact(nodes[:count], n)
    return outcomes, unturned, endless, first, ordered


@njit(cache=True, nogil=True)
def at_phases(first, phase, force, rate, wanted, out):  # type: ignore[no-untyped-def]
    """Force at phases `wanted` (n or 1, p), none above 1, into `out` (n, p): cubics between nodes,
    none below 0."""
    for i in range(len(out)):
        begin, last = first[i], first[i + 1] - 2
        row = wanted[i if len(wanted) > 1 else 0]
        node = begin
        for j in range(row.size):
            place = row[j]
            if place < phase[node]:
                node = begin
            while node < last and phase[node + 1] <= place:
                node += 1
            width = phase[node + 1] - phase[node]
            share = (place - phase[node]) / width if width > 0 else 1.0
            back = 1 - share
            blend = (
                force[node] * (1 + 2 * share) * back**2
                + force[node + 1] * (3 - 2 * share) * share**2
            )
            value = blend + share * back * (
                width * rate[node] * back - width * rate[node + 1] * share
            )
            out[i, j] = 0.0 if value < 0 else value
