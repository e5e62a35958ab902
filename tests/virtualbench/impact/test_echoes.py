"""What a plate's edges send back to an impactor that still touches it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from pyroshock.virtualbench.campaigns.ringing import echoes_at
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.impact.build import Impactor, contact_material, target
from pyroshock.virtualbench.impact.echoes import PlateEchoes
from pyroshock.virtualbench.impact.integrate import assemble, solve
from pyroshock.virtualbench.impact.strike import strike_many
from pyroshock.virtualbench.plate.build import resonant_plate
from pyroshock.virtualbench.plate.modes import PlateModes, modes

PLATE = target("aluminum", 0.010)
ELASTIC = Effects.none().with_strength("contact.plate_compliance", 1.0)


@cache
def bench_plate() -> PlateModes:
    return modes(
        resonant_plate("aluminum", "free", np.random.default_rng(0)),
        Effects.none(),
        max_frequency_hz=8e3,
    )


def echoes(point=0):
    return echoes_at(bench_plate(), point, PLATE)


def truths(tip, speeds, heard, effects=ELASTIC, struck=PLATE, **options):
    count = len(speeds)
    rng = np.random.default_rng(0)
    impactors = [Impactor(contact_material(tip), 0.03, 0.5)] * count
    return strike_many(impactors, [struck] * count, effects, speeds, rng, echoes=heard, **options)


def test_answer_is_that_of_the_modes_less_the_plate_without_edges():
    """By quadrature of both: a sum over modes, and an integral over all frequencies below them."""
    heard, time = echoes(), np.linspace(0, 2e-3, 40)
    omega, damping, z = 2 * np.pi * heard.frequencies_hz, heard.damping, heard.plate_impedance_n_s_m
    last = omega[-1]

    def window(w):
        return np.where(
            w > 0.6 * last, np.cos(np.pi / 2 * (w - 0.6 * last) / (0.4 * last)) ** 2, 1.0
        )

    grid = np.linspace(0, last, 20001)
    without = (
        np.trapezoid(window(grid) * np.cos(np.outer(time, grid)), grid, axis=1) * 2 / (np.pi * z)
    )
    turns = np.exp(-np.outer(time, damping * omega)) * np.cos(
        np.outer(time, omega * np.sqrt(1 - damping**2))
    )
    whole = turns @ (window(omega) * heard.shape_1_sqrt_kg**2)
    assert np.allclose(heard.answer(time), whole - without, atol=0.01 * without[0])
    # A plate of one rigid mode and a very low impedance's table moves as a mass: momentum is
    # shared.
    mass = 4.0
    alone = PlateEchoes(
        np.array([0.0, 9e3]), np.zeros(2), np.array([mass**-0.5, 0.0]), PLATE.plate_impedance_n_s_m
    )
    answer = alone.answer(np.linspace(1e-3, 2e-3, 50))
    assert np.allclose(answer, 1 / mass, atol=0.02 / mass)


def test_surface_moves_as_the_modes_do_under_that_force():
    """The chain's plate, P / Z and its echoes, is at the end where the modes put it, by Duhamel's
    integral."""
    heard = echoes()
    chain = assemble(
        [Impactor(contact_material("polyurethane"), 0.03, 0.5)],
        [PLATE],
        ELASTIC,
        np.random.default_rng(0),
    )
    solution = solve(chain, np.array([5.0]), steps_per_contact=250, echoes=heard)
    force, step = solution.plate_force_n[: solution.ends[0], 0], solution.step_s[0]
    since = step * (solution.ends[0] - np.arange(solution.ends[0]))
    omega = 2 * np.pi * heard.frequencies_hz
    damped = omega * np.sqrt(1 - heard.damping**2)
    sines = np.where(
        damped > 0,
        np.sin(np.outer(since, damped)) / np.where(damped > 0, damped, 1),
        since[:, None],
    )
    moved = (
        (force @ (np.exp(-np.outer(since, heard.damping * omega)) * sines))
        @ heard.shape_1_sqrt_kg**2
        * step
    )
    beyond = 2 / (np.pi * heard.plate_impedance_n_s_m * omega[-1]) * force[-1]
    assert solution.state[6, 0] == pytest.approx(moved + beyond, rel=5e-3)


def test_echoes_change_the_force_also_through_an_anvil_and_finer_steps_little():
    speeds = [2.0, 8.0]
    silent, same, heard = (truths("polyurethane", speeds, wave) for wave in (None, None, echoes()))
    for a, b, c in zip(silent, same, heard, strict=True):
        assert np.array_equal(a.force_n, b.force_n)
        assert abs(c.peak_force_n / a.peak_force_n - 1) > 1e-3
        assert 0.5 < c.peak_force_n / a.peak_force_n < 1.5
    struck = target("aluminum", 0.010, anvil_material="steel")
    silent, heard = (
        truths("polyurethane", [5.0], wave, ELASTIC, struck)[0] for wave in (None, echoes())
    )
    assert heard.restitution != silent.restitution
    assert heard.peak_force_n == pytest.approx(silent.peak_force_n, rel=0.2)
    coarse, fine = (truths("delrin", [5.0], echoes(), steps_per_contact=n)[0] for n in (250, 1000))
    assert coarse.peak_force_n == pytest.approx(fine.peak_force_n, rel=2e-3)
    assert coarse.contact_time_s == pytest.approx(fine.contact_time_s, rel=5e-3)


def test_rigid_plate_has_no_echo_and_echoes_come_late():
    """A short contact is over before the edges, 0.2 m away, send anything back."""
    light = Impactor(contact_material("steel"), 0.01, 0.01)
    silent, heard = (
        strike_many([light], [PLATE], ELASTIC, [2.0], np.random.default_rng(0), echoes=each)[0]
        for each in (None, echoes())
    )
    assert silent.contact_time_s < 1e-4
    assert heard.peak_force_n == pytest.approx(silent.peak_force_n, rel=0.02)
    effects = Effects.none()
    silent, heard = (truths("delrin", [5.0], each, effects)[0] for each in (None, echoes()))
    assert np.array_equal(
        silent.force_n, heard.force_n[: silent.force_n.size]
    )  # it is followed for longer
