"""The compiled motion of impactor and plate together: symbols as in `coupled.py`, SI.

a = x - y - d is the approach: the impactor's way x, the surface's displacement y of all modes, the
way d of a dashpot in series (mu); a = delta + layer(f) + C F, and F = f(delta) (1 + chi a'). C is
the compliance of what of the plate has no modes. Rigid modes and impactor are one inverse mass to
the approach.

A step is as long for all modes, and the force on it the cubic through F and F' at both ends. At its
end a = a_p - beta_0 F - beta_1 F', and so a' and a'': what the step brings without them is summed
over the modes, and the law closes the equations, in which the indentation is the only unknown that
is not linear.

Where the bodies touch, part, begin to yield or turn, the force is not smooth: such a step is tried
again with half its length, and so on, so that the unsmooth part lies in the shortest of steps.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from .kernel import hardening_curve, noted, with_room

_ITERATIONS = 60
#: Of the indentation: a step of Newton's after which the next would change the last digits, and the
#: secants' root.
_NEAR, _ROOT = 1e-7, 1e-12
_LINEAR = 1e-8
_LOADING, _UNLOADING = 0, 1
#: Steps of one length before the next longer one, after a touch.
_GROW = 2
#: A creeping impactor's step grows while it bends the force by less than this share of the tallest
#: and is no more than this share of the time; and shrinks when it bends it by more.
_STRAIGHT, _SHARE, _BENT = 2.5e-4, 0.04, 2e-3
_FAST = {"reassoc", "contract", "nsz"}


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def _predicted(table, modes, state, force, rate, ahead):  # type: ignore[no-untyped-def]
    """Into `ahead` (2, m) what the states are a step on without the force at its end; displacement
    and velocity."""
    moved = speed = 0.0
    for j in range(state.shape[1]):
        re, im = state[0, j], state[1, j]
        real = table[0, j] * re - table[1, j] * im + table[2, j] * force + table[4, j] * rate
        imag = table[1, j] * re + table[0, j] * im + table[3, j] * force + table[5, j] * rate
        ahead[0, j], ahead[1, j] = real, imag
        moved += imag
        speed += modes[0, j] * real + modes[1, j] * imag
    return moved, speed


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def _ended(table, ahead, force, rate, state):  # type: ignore[no-untyped-def]
    """The states at a step's end, where the force is known, from what they were without it."""
    for j in range(state.shape[1]):
        state[0, j] = ahead[0, j] + table[6, j] * force + table[8, j] * rate
        state[1, j] = ahead[1, j] + table[7, j] * force + table[9, j] * rate


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def _onward(table, modes, ahead, force, rate, further):  # type: ignore[no-untyped-def]
    """`_ended` and then `_predicted` in the same step: four times as fast as one after the
    other."""
    moved = speed = 0.0
    for j in range(ahead.shape[1]):
        re, im = ahead[0, j], ahead[1, j]
        real = table[0, j] * re - table[1, j] * im + table[10, j] * force + table[12, j] * rate
        imag = table[1, j] * re + table[0, j] * im + table[11, j] * force + table[13, j] * rate
        further[0, j], further[1, j] = real, imag
        moved += imag
        speed += modes[0, j] * real + modes[1, j] * imag
    return moved, speed


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def _acceleration(modes, ahead):  # type: ignore[no-untyped-def]
    """Of the surface, by springs and dampers of the modes."""
    total = 0.0
    for j in range(ahead.shape[1]):
        total += modes[3, j] * ahead[0, j] + modes[2, j] * ahead[1, j]
    return total


@njit(cache=True, nogil=True, error_model="numpy", fastmath=_FAST)
def _energy(energies, modes, state):  # type: ignore[no-untyped-def]
    total = 0.0
    for j in range(state.shape[1]):
        speed = modes[0, j] * state[0, j] + modes[1, j] * state[1, j]
        total += energies[0, j] * speed**2 + energies[1, j] * state[1, j] ** 2
    return total


@njit(cache=True, nogil=True, error_model="numpy")
def _static(law, depth):  # type: ignore[no-untyped-def]
    """f and its slope; `law` is factor, p, rest, the depth of yield and r, the hardening beyond it
    (`kernel.Law`)."""
    factor, exponent, rest, yields, hardening = law
    over = depth - rest
    if over <= 0.0:
        return 0.0, 0.0
    elastic = yields if over > yields else over
    root = factor * (math.sqrt(elastic) if exponent == 1.5 else elastic ** (exponent - 1.0))
    slope = exponent * root
    if hardening != 1.0 and over > elastic:
        beyond, steeper = hardening_curve(over / elastic, hardening)
        return elastic * root + slope * elastic * beyond, slope * steeper
    return elastic * root + slope * (over - elastic), slope


@njit(cache=True, nogil=True, error_model="numpy")
def _layer(compliance, stiffening, static):  # type: ignore[no-untyped-def]
    """By how much the layer gives way under f, and how fast that grows with f."""
    stiffer = stiffening * static
    share = math.log1p(stiffer) / stiffer if stiffer > _LINEAR else 1.0 - stiffer / 2
    return compliance * static * share, compliance / (1.0 + stiffer)


@njit(cache=True, nogil=True, error_model="numpy")
def _linear(law, series, ends, depth, grip):  # type: ignore[no-untyped-def]
    """For an indentation: what a is too large by; F, F', a', a'', d delta / dt; and about how fast
    the first falls.

    `grip`, 1 + chi a', is the last one there was where it is multiplied by unknowns.
    """
    chi, layer, stiffening, compliance = series
    free_approach, speed, bend, b0, b1, c0, c1, e0, e1 = ends
    static, slope = _static(law, depth)
    pressed, softness = _layer(layer, stiffening, static)
    both = 1.0 + (softness + compliance * grip) * slope
    kappa = slope * grip / both
    mu = static * chi * (1.0 - kappa * compliance)
    held = static * chi
    # a' = speed - c0 F - c1 F', a'' = bend - e0 F - e1 F', F = f + held a', F' = kappa a' + mu a''
    k11, k12 = 1.0 + c0 * held + c1 * kappa, c1 * mu
    k21, k22 = e0 * held + e1 * kappa, 1.0 + e1 * mu
    r1, r2 = speed - c0 * static, bend - e0 * static
    det = k11 * k22 - k12 * k21
    approach, curve = (r1 * k22 - k12 * r2) / det, (k11 * r2 - k21 * r1) / det
    force = static + held * approach
    if force < 0.0:
        force = 0.0
    rate = kappa * approach + mu * curve
    over = free_approach - b0 * force - b1 * rate - depth - pressed - compliance * force
    falls = 1.0 + slope * (softness + (compliance + b0) * grip / (1.0 + c0 * held))
    indenting = (approach - compliance * mu * curve) / both
    return over, force, rate, approach, curve, indenting, falls


@njit(cache=True, nogil=True, error_model="numpy")
def _closed(law, series, ends, guess, scale):  # type: ignore[no-untyped-def]
    """The end of a step in contact: indentation, F, F', a', d delta / dt. Newton's method, kept in
    its bracket."""
    factor, exponent, rest, yields, hardening = law
    _, layer, stiffening, compliance = series
    free_approach, speed, _, b0, b1, c0, c1, _, _ = ends
    low, high = rest, np.inf
    depth = guess if guess > rest else rest + 0.5 * (free_approach - rest)
    static = rate = approach = inverse = 0.0
    for _ in range(_ITERATIONS):
        over = depth - rest
        elastic = yields if over > yields else over
        root = factor * (math.sqrt(elastic) if exponent == 1.5 else elastic ** (exponent - 1.0))
        slope = exponent * root
        static = elastic * root + slope * (over - elastic)
        bend = (exponent - 1.0) * slope / elastic if over <= yields else 0.0
        if hardening != 1.0 and over > yields:
            beyond, steeper = hardening_curve(over / yields, hardening)
            static = elastic * root + slope * elastic * beyond
            slope *= steeper
            bend = (hardening - 1.0) * slope / over
        pressed, softness = _layer(layer, stiffening, static) if layer > 0.0 else (0.0, 0.0)
        inverse = 1.0 / (1.0 + (softness + compliance) * slope)
        kappa = slope * inverse
        freed = 1.0 / (1.0 + c1 * kappa)
        approach = (speed - c0 * static) * freed
        rate = kappa * approach
        off = free_approach - b0 * static - b1 * rate - depth - pressed - compliance * static
        if off > 0:
            low = depth
        else:
            high = depth
        hardens = inverse * inverse * bend
        if layer > 0.0:
            hardens += kappa * kappa * softness * stiffening * slope / (1.0 + stiffening * static)
        slows = -(c0 * slope + c1 * hardens * approach) * freed
        falls = (
            1.0 + slope * (b0 + softness + compliance) + b1 * (hardens * approach + kappa * slows)
        )
        after = depth + off / falls
        if not low < after < high:
            after = 0.5 * (low + high) if high < np.inf else low + 2.0 * (low - rest) + 0.1 * scale
        elif abs(after - depth) <= _NEAR * (depth - rest):
            change = after - depth
            static += slope * change
            approach += slows * change
            rate = (kappa + hardens * change) * approach
            return after, static, rate, approach, approach * inverse
        depth = after
    return depth, static, rate, approach, approach * inverse


@njit(cache=True, nogil=True, error_model="numpy")
def _closed_with_loss(law, series, ends, guess, grip, scale):  # type: ignore[no-untyped-def]
    """As `_closed`, where the law loses: by secants."""
    chi = series[0]
    low, high = law[2], np.inf
    depth = guess if guess > low else low + 0.5 * (ends[0] - low)
    last_depth, last_over = depth, 0.0
    force = rate = approach = indenting = 0.0
    for k in range(_ITERATIONS):
        over, force, rate, approach, _, indenting, falls = _linear(law, series, ends, depth, grip)
        if over > 0:
            low = depth
        else:
            high = depth
        grip = max(1.0 + chi * approach, 0.0)
        slope = falls
        if k > 0 and depth != last_depth:
            secant = (last_over - over) / (depth - last_depth)
            if secant > 0.1 * falls:
                slope = secant
        last_depth, last_over = depth, over
        after = depth + over / slope
        if not low < after < high:
            after = (
                0.5 * (low + high) if high < np.inf else low + 2.0 * (low - law[2]) + 0.1 * scale
            )
        depth = after
        if abs(depth - last_depth) <= _ROOT * (depth - law[2]) + 1e-3 * _ROOT * scale:
            break
    return last_depth, force, rate, approach, indenting


@njit(cache=True, nogil=True, error_model="numpy")
def _cubic(share, begin, end, rise, fall):  # type: ignore[no-untyped-def]
    """A cubic by its values and slopes at 0 and 1; and its slope."""
    back = 1.0 - share
    value = begin * (1 + 2 * share) * back**2 + end * (3 - 2 * share) * share**2
    value += share * back * (rise * back - fall * share)
    slope = (
        6 * share * back * (end - begin)
        + rise * back * (1 - 3 * share)
        - fall * share * (2 - 3 * share)
    )
    return value, slope


@njit(cache=True, nogil=True, error_model="numpy")
def _where_it_falls(begin, end, rise, fall, of_slope):  # type: ignore[no-untyped-def]
    """Share of a step at which a cubic, or its slope, falls through 0: by bisection, to the last
    digits."""
    low, high = 0.0, 1.0
    for _ in range(40):
        share = 0.5 * (low + high)
        value, slope = _cubic(share, begin, end, rise, fall)
        if (slope if of_slope else value) > 0:
            low = share
        else:
            high = share
    return 0.5 * (low + high)


@njit(cache=True, nogil=True, error_model="numpy")
def together(figures, step, base, modes, steps, answers, energies, rigid, compliance, ending):  # type: ignore[no-untyped-def]
    """Contacts of `figures` (n, 11): mass, velocity, k, p, chi, depth of yield, its hardening,
    layer's compliance and stiffening, mu, and a length, of the order of the indentation, against
    which nothing is measured.

    `step` (s) and the tables are those of `StepTables`; up to `base` halvings are for an impactor
    that creeps. `ending` (4,): most steps; share of all that was before for which the bodies stay
    apart when a contact is over; share of the force at the turn below which a contact that creeps
    is left; share of the time passed that it takes to creep out.

    Returns (9, n): contact time, time of the first turn, deepest and permanent indentation, the
    impactor's velocity at the end, 1 where the bodies parted, contacts, impulse, energy of the
    plate; and the nodes (k, 4): contact, time, force and its rate.
    """
    n, m, levels = len(figures), modes.shape[1], len(steps)
    results = np.zeros((9, n))
    # Plain numbers would be types of their own, for which what takes them is compiled once more.
    count, most = np.intp(0), np.intp(4)
    nodes = np.empty((256 * n + 64, 4))
    state, ahead, behind = np.zeros((2, m)), np.zeros((2, m)), np.zeros((2, m))
    last_level, longest = levels - 1, ending[0] * step
    for i in range(n):
        (
            mass,
            velocity,
            stiffness,
            exponent,
            chi,
            yields,
            hardening,
            layer,
            stiffening,
            mobility,
            scale,
        ) = figures[i]
        inverse = 1.0 / mass + rigid
        series = (chi, layer, stiffening, compliance)
        law = (stiffness, exponent, 0.0, yields, hardening)
        branch = _LOADING
        relative_displacement = time = impulse = dashed = 0.0
        force = rate = depth = indenting = 0.0
        deepest, compression, turned, force_at_turn = 0.0, 0.0, False, 0.0
        touching, parted, contacts, separation = True, False, 1.0, 0.0
        approach, level, steady, tallest, bending = velocity, last_level, 0, 0.0, 0.0
        before, exact = (
            last_level,
            True,
        )  # the level of the step before; whether `state` is that of this instant
        for j in range(m):
            state[0, j] = state[1, j] = 0.0
        moved, speed = _predicted(steps[level], modes, state, force, rate, ahead)
        nodes = with_room(nodes, count, most)
        count = noted(nodes, count, i, 0.0, 0.0, 0.0)
        while time < longest:
            h = step / 2**level
            answer = answers[level]
            relative = velocity - inverse * impulse
            bend = -_acceleration(modes, ahead) if chi > 0 else 0.0
            ends = (
                relative_displacement + h * relative
                - inverse * h * h * (0.35 * force + 0.05 * h * rate)
                - moved - dashed - mobility * h * (0.5 * force + h * rate / 12),
                relative - inverse * h * (0.5 * force + h * rate / 12) - speed,
                bend,
                0.15 * inverse * h * h + answer[0] + 0.5 * mobility * h,
                -inverse * h**3 / 30 + answer[3] - mobility * h * h / 12,
                0.5 * inverse * h + answer[1] + mobility,
                -inverse * h * h / 12 + answer[4],
                inverse + answer[2],
                answer[5] + mobility,
            )  # fmt: skip
            apart = ends[0] <= law[2]
            next_force = next_rate = 0.0
            next_depth, next_approach, next_indenting = ends[0], ends[1], ends[1]
            if not apart:
                guess = depth + h * (indenting + 0.5 * h * bending)
                if chi > 0:
                    next_depth, next_force, next_rate, next_approach, next_indenting = (
                        _closed_with_loss(
                            law, series, ends, guess, max(1.0 + chi * approach, 0.0), scale
                        )
                    )
                else:
                    next_depth, next_force, next_rate, next_approach, next_indenting = _closed(
                        law, series, ends, guess, scale
                    )
            begins = not touching and not apart
            parts = touching and apart
            yielding = branch == _LOADING and depth < yields < next_depth
            turns = touching and indenting > 0 and next_indenting <= 0 and not parts
            beyond_yield = turns and branch == _LOADING and max(depth, next_depth) > yields
            again = branch == _UNLOADING and next_depth > deepest and not apart
            if (begins or parts or yielding or beyond_yield or again) and level < last_level:
                if not exact:
                    _ended(steps[before], behind, force, rate, state)
                    exact = True
                level += 1
                steady = 0
                moved, speed = _predicted(steps[level], modes, state, force, rate, ahead)
                continue
            # the step is taken
            if turns:
                share = _where_it_falls(depth, next_depth, h * indenting, h * next_indenting, True)
                summit, _ = _cubic(share, depth, next_depth, h * indenting, h * next_indenting)
                deepest = max(deepest, summit)
                if not turned:
                    turned, compression = True, time + share * h
                    force_at_turn, _ = _cubic(share, force, next_force, h * rate, h * next_rate)
            if touching and not apart:
                deepest = max(deepest, next_depth)
            if parts:
                begin = (
                    depth
                    - law[2]
                    + _layer(layer, stiffening, _static(law, depth)[0])[0]
                    + compliance * force
                )
                share = _where_it_falls(begin, ends[0] - law[2], h * approach, h * ends[1], False)
                separation, touching = time + share * h, False
                if not turned:  # parted before it turned: the summit was in this step
                    turned, compression = True, time
            nodes = with_room(nodes, count, most)
            if begins:
                touching = True
                contacts += 1
                count = noted(nodes, count, i, time, 0.0, 0.0)
            relative_displacement += h * relative - inverse * h * h * (
                0.35 * force + 0.15 * next_force + h * (0.05 * rate - next_rate / 30)
            )
            bent = h * abs(next_rate - rate)
            tallest = max(tallest, next_force)
            pushed = h * (0.5 * (force + next_force) + h * (rate - next_rate) / 12)
            impulse += pushed
            dashed += mobility * pushed
            time += h
            bending = (next_indenting - indenting) / h if touching and not begins else 0.0
            force, rate, depth, approach, indenting = (
                next_force, next_rate, next_depth, next_approach, next_indenting,
            )  # fmt: skip
            before, ended_rate = level, rate
            if beyond_yield:
                branch = _UNLOADING
                top, _ = _static(law, deepest)
                recovered = deepest * top / (stiffness * deepest**exponent)
                law = (top / recovered**exponent, exponent, deepest - recovered, np.inf, 1.0)
            elif again:
                branch, law = _LOADING, (stiffness, exponent, 0.0, yields, hardening)
                static, slope = _static(law, depth)
                _, softness = _layer(layer, stiffening, static)
                grip = max(1.0 + chi * approach, 0.0)
                rate = slope * grip * approach / (1.0 + (softness + compliance * grip) * slope)
            if parts:
                count = noted(nodes, count, i, separation, 0.0, 0.0)
            elif touching:
                count = noted(nodes, count, i, time, force, rate)
            # how the next one goes
            steady += 1
            if not touching or yielding or beyond_yield or again:
                level, steady = min(level, base), 0
            elif begins:
                level, steady = last_level, 0
            elif level > base:
                if steady >= _GROW:
                    level, steady = level - 1, 0
            elif level < base and bent > _BENT * tallest:
                level, steady = level + 1, 0
            elif level > 0 and steady >= _GROW and bent < _STRAIGHT * tallest and h < _SHARE * time:
                level, steady = level - 1, 0
            if level == before:
                moved, speed = _onward(steps[level], modes, ahead, force, rate, behind)
                ahead, behind, exact = behind, ahead, False
            else:
                _ended(steps[before], ahead, force, ended_rate, state)
                exact = True
                moved, speed = _predicted(steps[level], modes, state, force, rate, ahead)
            if not touching and time - separation > ending[1] * separation:
                parted = True
                break
            creeping = touching and turned and force < ending[2] * force_at_turn and rate < 0
            if creeping and depth - law[2] > -indenting * ending[3] * time:
                separation = time
                break
        if not exact:
            _ended(steps[before], behind, force, rate, state)
        if not parted and touching:
            separation = time
        elif not parted:
            parted = True
        results[0, i], results[1, i], results[2, i], results[3, i] = (
            separation,
            compression,
            deepest,
            law[2],
        )
        results[4, i], results[5, i], results[6, i], results[7, i] = (
            velocity - impulse / mass,
            parted,
            contacts,
            impulse,
        )
        results[8, i] = _energy(energies, modes, state) + 0.5 * rigid * impulse**2
    return results, nodes[:count]
