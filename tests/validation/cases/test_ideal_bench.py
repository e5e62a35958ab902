"""Benches without effects are the nominal ones, and quick routes give what the whole ones give."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.validation.cases.case import TOLERANCES
from pyroshock.validation.cases.contact_case import strikes
from pyroshock.validation.cases.designs import DESIGNS, CaseSetting, design
from pyroshock.validation.cases.effect_size import nominal_pulses, speeds_of
from pyroshock.validation.cases.gun_case import gun_of, gun_stage, ln_velocity
from pyroshock.validation.cases.plates import changed, plate_of
from pyroshock.validation.cases.ringing import accelerations, levels_db, modal_pulse
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun import compiled_balances
from pyroshock.virtualbench.gun.build import GunBuild, Projectile, setting_of
from pyroshock.virtualbench.gun.fire import fire
from pyroshock.virtualbench.gun.integrate import muzzle_velocity
from pyroshock.virtualbench.gun.motion import Phase, V, X, derivative, initial_state
from pyroshock.virtualbench.impact.build import contact_material
from scipy.signal import lsim

#: What a difference between ideal bench and nominal simulator may be, in tolerances.
SMALL = 0.3


@pytest.mark.parametrize("number", range(DESIGNS))
def test_ideal_shot_is_the_adiabatic_expansion_of_the_thesis(number: int) -> None:
    """Equation 2.16 with a gauge pressure and efficiency 1."""
    stage = gun_stage("gun", number)
    plan = design("gun", number)
    pressure = np.array([s.tank_pressure_bar * 1e5 for s in plan])
    mass = np.array([s.mass_kg for s in plan])
    tank, way, friction = (
        float(stage[k]) for k in ("tank_volume_m3", "travel_m", "friction_coefficient")
    )
    area = np.pi * float(stage["projectile_diameter_m"]) ** 2 / 4
    work = pressure * tank / 0.4 * (1 - (tank / (tank + area * way)) ** 0.4)
    expected = np.sqrt(2 * (work - friction * mass * 9.80665 * way) / mass)
    assert (
        np.abs(ln_velocity("gun", number, {}) - np.log(expected)).max() < 0.02 * TOLERANCES["gun"]
    )


@pytest.mark.parametrize("kind", ["hammer", "chain"])
def test_ideal_impact_is_hertz_on_a_rigid_target(kind: str) -> None:
    """Peak and contact time of Johnson, Contact Mechanics (1985), section 11.4; impulse 2 m v."""
    plan = design(kind, 1)
    for setting, pulse, v in zip(plan, nominal_pulses(kind, 1), speeds_of(kind, 1), strict=True):
        peak, duration = _hertz(setting, float(v))
        ln_peak, ln_impulse, _ = pulse.figures
        assert ln_peak == pytest.approx(np.log(peak), abs=0.02 * TOLERANCES["contact"])
        assert ln_impulse == pytest.approx(
            np.log(2 * setting.mass_kg * v), abs=0.02 * TOLERANCES["contact"]
        )
        assert np.count_nonzero(pulse.force_n) * pulse.step_s == pytest.approx(duration, rel=0.02)


def _hertz(setting: CaseSetting, v: float) -> tuple[float, float]:
    tip, face = contact_material(setting.tip_material), contact_material(setting.face_material)
    modulus, radius = 1 / (tip.compliance_1_pa + face.compliance_1_pa), setting.tip_radius_mm * 1e-3
    stiffness = 4 / 3 * modulus * np.sqrt(radius)
    deepest = (5 * setting.mass_kg * v**2 / (4 * stiffness)) ** 0.4
    return stiffness * deepest**1.5, 2.9432 * deepest / v


def test_ideal_plate_answers_as_its_table_says() -> None:
    """Sum over modes of the accelerations of unit-mass oscillators, here by a state-space solver on
    a finer grid."""
    plate, rate = plate_of("plate", 0), 102_400.0
    pulse = modal_pulse(0.25e-3, 0.85)
    shown = accelerations(plate.table, pulse, 1e-3, rate, 1024)
    time = np.arange(1024 * 16) / (rate * 16)
    force, expected = pulse.on(time - 1e-3), np.zeros((2, time.size))
    for f, zeta, at_hit, shapes in zip(
        plate.table.frequencies_hz,
        plate.table.damping,
        plate.table.shape_impact[0],
        plate.table.shapes.T,
        strict=True,
    ):
        omega = 2 * np.pi * f
        _, q, _ = lsim(([1.0, 0.0, 0.0], [1.0, 2 * zeta * omega, omega**2]), force, time)
        expected += np.outer(shapes * at_hit, q)
    assert np.abs(shown - expected[:, ::16]).max() < 2e-3 * np.abs(expected).max()


def test_force_between_samples_is_no_gap_of_its_own() -> None:
    """The nominal plate under the *sampled* force, straight between its samples: spectra within 0.3
    of a tolerance."""
    plate, rate = plate_of("plate", 1), 102_400.0
    from pyroshock.virtualbench.plate.respond import respond

    for pulse_s in (0.12e-3, 0.25e-3, 0.8e-3):
        pulse, start, time = modal_pulse(pulse_s, 0.85), 1e-3 + 0.4 / rate, np.arange(6144) / rate
        true = levels_db(accelerations(plate.table, pulse, start, rate, 6144), plate, rate)
        sampled = respond(plate.table, time, pulse.on(time - start), time, bandwidth_hz=np.inf)
        gap = (levels_db(sampled, plate, rate) - true) / TOLERANCES["plate"]
        assert np.sqrt(np.mean(gap**2)) < SMALL


def test_benches_without_effects_are_their_tables() -> None:
    plate = plate_of("chain", 2)
    np.testing.assert_array_equal(changed(plate, {}).frequencies_hz, plate.table.frequencies_hz)
    weak = changed(plate, {"plate.sensor_mass": 1e-9, "plate.boundary": 1e-3})
    np.testing.assert_allclose(weak.frequencies_hz, plate.table.frequencies_hz, rtol=1e-6)
    assert len({gun_of("gun", number) for number in range(DESIGNS)}) == DESIGNS
    bare, layered = CaseSetting(insulator="none"), CaseSetting(insulator="polymeric")
    first, second = strikes([bare, layered], np.array([1.0, 1.0]), {})
    np.testing.assert_allclose(first.force_n, second.force_n, rtol=1e-9)


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
        now = compiled_balances.rates(
            0.2, state, compiled_balances.figures_of(setting), phase.held, phase.sealed
        )
        np.testing.assert_allclose(
            now, derivative(0.2, state, setting, phase), rtol=1e-12, atol=1e-12
        )


@pytest.mark.parametrize("effects", BENCHES[:4])
@pytest.mark.parametrize("pressure", [3e4, 3e5])
def test_muzzle_velocity_alone_is_that_of_the_whole_shot(effects: Effects, pressure: float) -> None:
    shot = fire(GunBuild(), effects, pressure, Projectile(), np.random.default_rng(1), until_s=0.7)
    alone = muzzle_velocity(
        GunBuild(), effects, pressure, Projectile(), np.random.default_rng(1), until_s=0.7
    )
    assert alone == pytest.approx(shot.muzzle_velocity_m_s, rel=1e-8)


def test_a_shot_that_stays_in_the_barrel_has_no_velocity() -> None:
    stuck = GunBuild(friction_coefficient=50.0)
    assert (
        muzzle_velocity(stuck, Effects.none(), 1e4, Projectile(), np.random.default_rng(1)) == 0.0
    )
