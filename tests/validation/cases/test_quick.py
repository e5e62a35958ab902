"""The quick routes give what the whole ones give."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun import compiled_balances
from pyroshock.virtualbench.gun.build import GunBuild, Projectile, setting_of
from pyroshock.virtualbench.gun.fire import fire
from pyroshock.virtualbench.gun.integrate import muzzle_velocity
from pyroshock.virtualbench.gun.motion import Phase, V, X, derivative, initial_state
from pyroshock.virtualbench.impact.build import hammer, target
from pyroshock.virtualbench.impact.integrate import assemble, solve
from pyroshock.virtualbench.impact.kernel import contact_forces

BENCHES = (
    Effects.none(),
    Effects.default(),
    Effects.only("gun.valve_flow", 0.5),
    Effects.only("gun.heat_exchange", 3.0),
    Effects.only("contact.plate_compliance"),
    Effects.only("contact.tip_geometry", -3.0),
)


@pytest.mark.parametrize("phase", [Phase(False, True), Phase(False, False), Phase(True, False)])
@pytest.mark.parametrize("effects", BENCHES[:4])
def test_compiled_rates_are_those_of_the_balances(effects: Effects, phase: Phase) -> None:
    rng = np.random.default_rng(4)
    setting = setting_of(GunBuild(), effects, 1e5, Projectile(), rng)
    for x, v in ((0.0, 0.0), (-1e-4, -0.01), (0.4, 12.0), (0.9, 25.0), (1.5, -4.0)):
        state = initial_state(setting) * np.append(rng.uniform(0.9, 1.1, 6), np.ones(6))
        state[X], state[V] = x, v
        now = compiled_balances.rates(0.2, state, compiled_balances.figures_of(setting), phase.held, phase.sealed)
        np.testing.assert_allclose(now, derivative(0.2, state, setting, phase), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("effects", BENCHES[:4])
@pytest.mark.parametrize("pressure", [3e4, 3e5])
def test_muzzle_velocity_alone_is_that_of_the_whole_shot(effects: Effects, pressure: float) -> None:
    shot = fire(GunBuild(), effects, pressure, Projectile(), np.random.default_rng(1), until_s=0.7)
    alone = muzzle_velocity(GunBuild(), effects, pressure, Projectile(), np.random.default_rng(1), until_s=0.7)
    assert alone == pytest.approx(shot.muzzle_velocity_m_s, rel=1e-8)


def test_a_shot_that_stays_in_the_barrel_has_no_velocity() -> None:
    stuck = GunBuild(friction_coefficient=50.0)
    assert muzzle_velocity(stuck, Effects.none(), 1e4, Projectile(), np.random.default_rng(1)) == 0.0


@pytest.mark.parametrize("effects", [BENCHES[k] for k in (0, 1, 4, 5)])
def test_compiled_impacts_are_those_of_the_chain(effects: Effects) -> None:
    impactors = [hammer(tip, 0.03) for tip in ("aluminum", "steel", "delrin", "polyurethane")]
    struck = [("none", "none"), ("steel", "polymeric"), ("aluminum", "none"), ("steel", "none")]
    targets = [target("aluminum", 0.01, anvil_material=anvil, insulator=layer) for anvil, layer in struck]
    speeds = np.array([0.5, 1.0, 2.0, 3.0])
    whole = solve(assemble(impactors, targets, effects, np.random.default_rng(1)), speeds, steps_per_contact=100)
    quick = contact_forces(impactors, targets, effects, speeds, np.random.default_rng(1), steps_per_contact=100)
    for k, (step, force) in enumerate(quick):
        assert (step, force.size) == (pytest.approx(whole.step_s[k], rel=1e-12), whole.ends[k])
        np.testing.assert_allclose(force, whole.contact_force_n[: force.size, k], rtol=1e-8, atol=1e-8)
