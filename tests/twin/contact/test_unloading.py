"""Unloading with a permanent indentation, eq. 1.17, and the loops of solved impacts against it.

Glossary: F force, delta indentation, max at the deepest, p what stays, n exponent.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.twin.contact.hertz import hertz
from pyroshock.twin.contact.impact import solve
from pyroshock.twin.contact.impacts import Impacts
from pyroshock.twin.contact.kernel import Law, unloading
from support.records.contact_bodies import impacts

PEAK, DEEPEST, PERMANENT = np.array([800.0]), np.array([3e-4]), np.array([1e-4])


def unloading_force(
    indentation_m: Floats, peak_force_n: Floats, deepest_m: Floats, permanent_m: Floats, exponent: Floats | float = 1.5
) -> Floats:
    """F = F_max ((delta - delta_p) / (delta_max - delta_p))^n, 0 below delta_p; arguments broadcast.

    Raises `ValueError` unless 0 <= delta_p < delta_max.
    """
    if np.any((permanent_m < 0) | (permanent_m >= deepest_m)):
        raise ValueError("permanent_m: expected 0 or more, and less than deepest_m")
    share = np.clip((indentation_m - permanent_m) / (deepest_m - permanent_m), 0.0, None)
    return np.asarray(peak_force_n * share**exponent)


def returned_work(
    peak_force_n: Floats, deepest_m: Floats, permanent_m: Floats, exponent: Floats | float = 1.5
) -> Floats:
    """Area below eq. 1.17 (J): F_max (delta_max - delta_p) / (n + 1)."""
    return np.asarray(peak_force_n * (deepest_m - permanent_m) / (exponent + 1))


def restitution_of_loop(
    loading_work_j: Floats,
    peak_force_n: Floats,
    deepest_m: Floats,
    permanent_m: Floats,
    exponent: Floats | float = 1.5,
) -> Floats:
    """e = sqrt(W_r / W_c) of a loading of known work and its unloading after eq. 1.17 (eq. 1.11)."""
    return np.sqrt(returned_work(peak_force_n, deepest_m, permanent_m, exponent) / loading_work_j)


def test_curve_runs_from_the_peak_to_what_stays() -> None:
    depth = np.array([0.5e-4, 1e-4, 2e-4, 3e-4])
    assert unloading_force(depth, PEAK, DEEPEST, PERMANENT) == pytest.approx([0, 0, 800 / 2**1.5, 800])


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_returned_work_is_the_area_below(exponent: float) -> None:
    depth = np.linspace(1e-4, 3e-4, 4001)
    area = np.trapezoid(unloading_force(depth, PEAK, DEEPEST, PERMANENT, exponent), depth)
    assert returned_work(PEAK, DEEPEST, PERMANENT, exponent) == pytest.approx([area], rel=1e-6)


def test_nothing_stays_where_nothing_yielded() -> None:
    """Hertz' loading and eq. 1.17 without a mark are one curve: the loop has no area, e = 1."""
    law = Law(1.5, 1.0, 0.0, 0.9, 0.0, 0.0, 0.0, 0.0)
    assert unloading(law, 0.8) == law._replace(yield_depth=np.inf)
    assert restitution_of_loop(0.4 * PEAK * DEEPEST, PEAK, DEEPEST, 0 * DEEPEST) == pytest.approx([1.0])


def test_loop_area_is_the_energy_lost() -> None:
    """Of a solved impact: loading work minus returned work against the kinetic energy, and e = sqrt(W_r / W_c)."""
    bodies = impacts()
    nominal = Impacts.of(bodies)
    load = 0.2 * hertz(bodies).peak_force_n
    pulse = solve(replace(nominal, yield_load_n=load))
    depth = np.linspace(0, pulse.deepest_indentation_m[0], 20_001)
    stiffness = nominal.stiffness_n_mp
    reach = (load / stiffness) ** (2 / 3)
    loading = np.where(depth < reach, stiffness * depth**1.5, load + 1.5 * load / reach * (depth - reach))
    work = np.trapezoid(loading, depth)
    loop = (pulse.peak_force_n, pulse.deepest_indentation_m, pulse.permanent_indentation_m)
    kinetic = 0.32 / 2 * (1.2**2 - pulse.separation_velocity_m_s**2)
    assert work - returned_work(*loop) == pytest.approx(kinetic, rel=1e-6)
    assert restitution_of_loop(work, *loop) == pytest.approx(pulse.restitution.value, rel=1e-6)


@pytest.mark.parametrize("permanent", [-1e-6, 3e-4])
def test_impossible_marks_are_refused(permanent: float) -> None:
    with pytest.raises(ValueError, match="permanent_m: expected"):
        unloading_force(DEEPEST, PEAK, DEEPEST, np.array([permanent]))
