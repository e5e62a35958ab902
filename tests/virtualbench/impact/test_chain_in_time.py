"""The compiled chain against SciPy's integrator on its equations, and against its own batches."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.impact.build import hammer, target
from pyroshock.virtualbench.impact.chain import Chain
from pyroshock.virtualbench.impact.integrate import assemble, contact_forces, solve
from pyroshock.virtualbench.impact.kernel import elastic_force
from scipy.integrate import solve_ivp

IMPACTORS = [hammer(tip, 0.03) for tip in ("aluminum", "steel", "delrin", "polyurethane")]
TARGETS = [
    target("aluminum", 0.01, anvil_material=anvil, insulator=layer)
    for anvil, layer in (
        ("none", "none"), ("steel", "polymeric"), ("aluminum", "none"), ("steel", "none"),
    )
]  # fmt: skip
SPEEDS = np.array([0.5, 1.0, 2.0, 3.0])


def _chain(effects: Effects, impacts: slice = slice(None)) -> Chain:
    return assemble(IMPACTORS[impacts], TARGETS[impacts], effects, np.random.default_rng(1))


def _rates(state: Floats, chain: Chain, deepest: float) -> tuple[list[float], float]:
    """Newton's law of each mass in a chain of one impact, as `kernel` states it, and the force."""
    front, v_front, rear, v_rear, anvil, v_anvil, plate, settled, relaxed = state
    c = {part.name: getattr(chain, part.name).item() for part in fields(chain)[1:]}
    pressed = max(settled, 0.0) + c["layer_seating_n"]
    depth = (pressed**0.5 - c["layer_seating_n"] ** 0.5) / c["layer_n_m2"] ** 0.5
    layer = c["layer_share"] * depth / (1 + depth / c["layer_limit_m"])
    on_anvil = c["inverse_anvil_1_kg"] > 0
    indentation = front - (anvil if on_anvil else plate) - layer
    elastic = elastic_force(indentation, deepest, chain.law.figures[0])
    force = max(elastic + c["relaxing"] * (elastic - relaxed), 0.0)
    neck = c["neck_n_m"] * (rear - front) + c["neck_n_s_m"] * (v_rear - v_front)
    # The joint's damper spans the anvil and the plate, which moves with the joint's force over Z.
    spring = c["joint_n_m"] * (anvil - plate) + c["joint_n_s_m"] * v_anvil
    joint = spring / (1 + c["joint_n_s_m"] * c["plate_mobility_m_n_s"])
    on_plate = joint if on_anvil else force
    return [
        v_front,
        (neck - force) / c["front_kg"],
        v_rear,
        -neck * c["inverse_rear_1_kg"],
        v_anvil,
        (force - joint) * c["inverse_anvil_1_kg"],
        c["plate_mobility_m_n_s"] * on_plate,
        (force - settled) / c["retardation_s"],
        (elastic - relaxed) / c["relaxation_s"],
    ], force


@pytest.mark.parametrize("number", range(len(SPEEDS)))
def test_force_until_its_peak_is_scipys_solution_of_the_equations(number: int) -> None:
    """Until the peak the contact only loads, so that its law has no memory."""
    effects = Effects.default().without("bench.hand_scatter")
    chain = _chain(effects, slice(number, number + 1))
    solution = solve(chain, SPEEDS[number : number + 1], steps_per_contact=1000)
    history = solution.contact_force_n[:, 0]
    stop = int(np.flatnonzero(np.diff(history) < 0)[0])
    time = solution.step_s[0] * np.arange(stop)
    start = np.zeros(9)
    start[[1, 3]] = SPEEDS[number]
    states = solve_ivp(
        lambda _, state: _rates(state, chain, 0.0)[0],
        (0, time[-1]), start, method="LSODA", t_eval=time, rtol=1e-10, atol=1e-14,
    ).y.T  # fmt: skip
    forces = [_rates(state, chain, 0.0)[1] for state in states]
    np.testing.assert_allclose(history[:stop], forces, rtol=0, atol=2e-5 * history.max())


@pytest.mark.parametrize("strength", [0.0, 1.0])
def test_impact_of_a_batch_is_the_impact_alone(strength: float) -> None:
    effects = Effects.only("contact.tip_geometry", strength).with_strength(
        "contact.viscous_loss", strength
    )
    batch = contact_forces(IMPACTORS, TARGETS, effects, SPEEDS, np.random.default_rng(1))
    for index, (step, force) in enumerate(batch):
        impact = slice(index, index + 1)
        ((alone_step, alone),) = contact_forces(
            IMPACTORS[impact], TARGETS[impact], effects, SPEEDS[impact], np.random.default_rng(1)
        )
        assert step == alone_step
        np.testing.assert_array_equal(force, alone)
