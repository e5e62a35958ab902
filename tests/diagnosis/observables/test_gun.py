"""The gun's stage against the gun itself: shots, sensors, sets at once, uncertain settings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.diagnosis.observables.base import at_rows, batched_changes, stacked
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.record import CampaignRecord, Run, RunConfiguration
from pyroshock.signals.valve_profile import ValveProfile
from pyroshock.twin.effects import Effect, catalogue, effect
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.gun.nominal import muzzle_velocity
from pyroshock.twin.gun.shot import GunEffect
from pyroshock.twin.gun.shots import gun_velocity
from support.records.gun_campaigns import gun_record

BENCH = GunBench(0.0095, 0.049, 0.048, 0.885, 0.2, 1.4, 0.9)
PRESSURES, MASSES = (0.3e5, 1.2e5, 4e5), (0.25, 1.0)
GUN = [kind() for kind in catalogue().values() if issubclass(kind, GunEffect)]
SENSORS = [
    effect("sensor.pressure_offset", offset_pa=4e3),
    effect("sensor.pressure_gain", gain=1.1),
    effect("sensor.velocity_gain", gain=0.9),
]
EACH = pytest.mark.parametrize("each", [*GUN, *SENSORS], ids=lambda each: each.id)


def record(repeats: int = 3, **changed: object) -> CampaignRecord:
    """Six settings; the pressure of a repetition is off by 1 % of it, the middle one is on it."""
    at = [(p, m) for p in PRESSURES for m in MASSES]
    configurations = tuple(
        RunConfiguration(f"{p:g} Pa, {m:g} kg", {"tank_pressure": p, "bullet_mass": m})
        for p, m in at
    )
    runs = tuple(
        Run(
            c,
            6 * j + c,
            j + 1,
            6 * j + c,
            p * (1 + 0.01 * (j - repeats // 2)),
            m,
            10.0 + c,
            0.05 * (10.0 + c),
        )
        for j in range(repeats)
        for c, (p, m) in enumerate(at)
    )
    return replace(CampaignRecord("six settings", "gun", configurations, runs, BENCH), **changed)


def without(stage_record: CampaignRecord, row: int, **missing: object) -> CampaignRecord:
    runs = list(stage_record.runs)
    runs[row] = replace(runs[row], **missing)
    return replace(stage_record, runs=tuple(runs))


def pressures(of: CampaignRecord) -> np.ndarray:
    return np.array([run.tank_pressure_pa for run in of.runs])


def masses(of: CampaignRecord) -> np.ndarray:
    return np.array([run.bullet_mass_kg for run in of.runs])


#: Travels of the two bullets: the second one is longer, and has less of the barrel before it.
TRAVELS = {0.25: 0.885, 1.0: 0.6}


def with_travels(of: CampaignRecord) -> CampaignRecord:
    return replace(
        of, runs=tuple(replace(run, travel_m=TRAVELS[run.bullet_mass_kg]) for run in of.runs)
    )


def of_bullet(values: np.ndarray, of: CampaignRecord, mass_kg: float) -> np.ndarray:
    """Rows of the configurations with this bullet."""
    return values[[c.factors["bullet_mass"] == mass_kg for c in of.configurations]]


@pytest.mark.parametrize("name", ["travel_m", "friction_coefficient", "bullet_mass_kg"])
def test_uncertain_settings_act_over_each_bullet_s_travel(name: str) -> None:
    mixed = GunObservables(with_travels(record()), {name: 0.01})
    for mass, travel in TRAVELS.items():
        alone = GunObservables(record(gun=replace(BENCH, travel_m=travel)), {name: 0.01})
        np.testing.assert_allclose(
            of_bullet(mixed.nuisances()[name], mixed.record, mass),
            of_bullet(alone.nuisances()[name], mixed.record, mass),
            rtol=1e-6,
        )


def test_nominal_is_eq_2_16_with_each_bullet_s_travel() -> None:
    six = record()
    expected = np.log(muzzle_velocity(BENCH, pressures(six), masses(six)))
    assert GunObservables(six).simulated()[:, 0] == pytest.approx(expected, rel=1e-12)
    # Eq. 2.16 with each bullet's L.
    shown = GunObservables(with_travels(six)).simulated()[:, 0]
    for mass, travel in TRAVELS.items():
        rows = masses(six) == mass
        expected = np.log(
            muzzle_velocity(
                replace(BENCH, travel_m=travel), pressures(six)[rows], masses(six)[rows]
            )
        )
        assert shown[rows] == pytest.approx(expected, rel=1e-12)
    assert GunObservables(record()).measured()[:6, 0] == pytest.approx(
        np.log(np.arange(10.0, 16.0))
    )
    runs = tuple(
        replace(run, velocity_m_s=v)
        for run, v in zip(six.runs, GunObservables(six).output(), strict=True)
    )
    assert GunObservables(replace(six, runs=runs)).residuals() == pytest.approx(
        np.zeros((18, 1)), abs=1e-12
    )


def test_floor_is_the_stated_uncertainty_or_assumed() -> None:
    assert GunObservables(record()).observables[0].floor == pytest.approx(0.05)
    six = record()
    runs = tuple(replace(run, velocity_u_m_s=None) for run in six.runs)
    assert GunObservables(replace(six, runs=runs)).observables[0].floor == 0.01


@EACH
def test_effects_are_the_guns_over_each_bullet_s_travel(each: Effect) -> None:
    six = record()
    true_pressure, gain = pressures(six), 1.0
    if each.id == "sensor.pressure_offset":
        true_pressure = true_pressure - 4e3
    elif each.id == "sensor.pressure_gain":
        true_pressure = true_pressure / 1.1
    elif each.id == "sensor.velocity_gain":
        gain = 0.9
    acting = [each] if isinstance(each, GunEffect) else []
    expected = np.log(gain * gun_velocity(BENCH, true_pressure, masses(six), acting).velocity_m_s)
    assert GunObservables(six).simulated([each])[:, 0] == pytest.approx(expected, rel=1e-5)
    mixed = GunObservables(with_travels(record()))
    changes = mixed.changes([[each], []])
    for mass, travel in TRAVELS.items():
        alone = GunObservables(record(gun=replace(BENCH, travel_m=travel)))
        np.testing.assert_allclose(
            of_bullet(changes[0], mixed.record, mass),
            of_bullet(alone.changes([[each]])[0], mixed.record, mass),
            rtol=1e-5,
        )


def test_pressure_is_undone_backwards_and_velocity_shown_last() -> None:
    six = record()
    true_pressure = (pressures(six) - 4e3) / 1.1
    expected = gun_velocity(
        BENCH, true_pressure, masses(six), [effect("gun.back_pressure")]
    ).velocity_m_s
    stage, effects = GunObservables(six), [*SENSORS, effect("gun.back_pressure")]
    assert stage.simulated(effects)[:, 0] == pytest.approx(np.log(0.9 * expected), rel=1e-12)
    assert stage.output(effects) == pytest.approx(expected, rel=1e-12)
    expected = muzzle_velocity(BENCH, pressures(six) + 5e3, masses(six))
    given_pressures = [float(p) for p in pressures(six) + 5e3]
    assert GunObservables(six).output(SENSORS, given_pressures) == pytest.approx(
        expected, rel=1e-12
    )


def test_shot_that_stays_in_the_barrel_is_nan() -> None:
    stage = GunObservables(record(1))
    stuck = [effect("gun.sliding_friction", seal_force_n=100.0)]
    assert list(np.isnan(stage.simulated(stuck)[:, 0])) == [True, True, False, False, False, False]
    assert list(np.isnan(stage.changes([stuck])[0, :, 0])) == [
        True,
        True,
        False,
        False,
        False,
        False,
    ]
    assert list(np.isnan(stage.output(stuck))) == [True, True, False, False, False, False]


@pytest.mark.parametrize("name", ["tank_pressure_pa", "bullet_mass_kg", "velocity_m_s"])
def test_run_without_a_reading_is_nan(name: str) -> None:
    residuals = GunObservables(without(record(1), 2, **{name: None})).residuals()
    assert list(np.flatnonzero(np.isnan(residuals[:, 0]))) == [2]


def test_arrays_of_parameters_go_with_the_runs() -> None:
    six, share = without(record(1), 2, tank_pressure_pa=None), np.linspace(0, 1, 6)
    together = GunObservables(six).simulated([effect("gun.heat_exchange", share=share)])
    alone = [
        GunObservables(six).simulated([effect("gun.heat_exchange", share=s)])[c, 0]
        for c, s in enumerate(share)
    ]
    assert together[:, 0] == pytest.approx(alone, rel=1e-12, nan_ok=True)


def test_changes_of_mixed_sets_are_those_one_by_one() -> None:
    stage = GunObservables(record())
    sets: list[list[Effect]] = [
        [],
        [effect("gun.blow_by", wear_m=2e-4)],
        [effect("sensor.pressure_offset", offset_pa=-2e3), effect("gun.blow_by")],
        [effect("contact.viscous_loss")],
        [effect("gun.blow_by"), effect("sensor.pressure_offset", offset_pa=5e3)],
        [
            effect("gun.blow_by", wear_m=4e-4),
            effect("contact.viscous_loss"),
            effect("sensor.force_gain"),
        ],
        [effect("gun.valve_flow", loss_coefficient=3.0)],
    ]
    alone = [(stage.simulated(effects) - stage.simulated())[6:12] for effects in sets]
    assert stage.changes(sets) == pytest.approx(np.array(alone), abs=1e-9)
    kinds = [type(off_effect) for off_effect in (*GUN, *SENSORS)]
    off = [kind(**{item.name: item.off for item in kind.parameters()}) for kind in kinds]
    assert np.all(stage.changes([[], *[[off_effect] for off_effect in off]]) == 0)


@settings(max_examples=25)
@given(
    st.lists(
        st.tuples(st.floats(-3e4, 2e4), st.floats(0.8, 1.25), st.floats(0.0, 1.0)).map(
            lambda x: [
                effect("sensor.pressure_offset", offset_pa=x[0]),
                effect("sensor.velocity_gain", gain=x[1]),
                effect("gun.heat_exchange", share=x[2]),
            ]
        ),
        min_size=1,
        max_size=5,
    )
)
def test_changes_do_not_hang_on_company(sets: list[list[Effect]]) -> None:
    stage = GunObservables(record(1))
    found = stage.changes(sets)
    assert found.shape == (len(sets), 6, 1)
    for k, effects in enumerate(sets):
        assert found[k] == pytest.approx(stage.changes([effects])[0], abs=1e-12)


def test_cost_grows_with_configurations_not_with_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    fired: list[int] = []

    def counted(*given: object, **more: object) -> object:
        fired.append(np.size(given[1]))
        return gun_velocity(*given, **more)

    stage = GunObservables(record(30))
    monkeypatch.setattr("pyroshock.diagnosis.observables.gun.stage.gun_velocity", counted)
    stage.changes([[effect("gun.blow_by", wear_m=w)] for w in (1e-4, 2e-4, 3e-4)])
    assert sorted(fired) == [6, 18]


def test_shown_are_the_guns_and_three_sensors_effects() -> None:
    gun = [identity for identity in catalogue() if identity.startswith("gun.")]
    sensors = ["sensor.pressure_gain", "sensor.pressure_offset", "sensor.velocity_gain"]
    assert list(GunObservables(record()).shows) == [*gun, *sensors]
    six = record()
    runs = tuple(replace(run, velocity_m_s=None) for run in six.runs)
    assert GunObservables(replace(six, runs=runs)).shows == ()
    with pytest.raises(ValueError, match="no gun"):
        GunObservables(record(gun=None))


@pytest.mark.parametrize(
    ("name", "sd"),
    [
        ("friction_coefficient", 0.05),
        ("tank_volume_m3", 1e-4),
        ("travel_m", 0.01),
        ("efficiency", 0.02),
    ],
)
def test_nuisance_is_a_standard_deviations_change(name: str, sd: float) -> None:
    six, h = record(), 1e-3
    moved = [replace(BENCH, **{name: getattr(BENCH, name) + sign * h * sd}) for sign in (1, -1)]
    high, low = (GunObservables(replace(six, gun=bench)).simulated()[6:12] for bench in moved)
    column = GunObservables(six, {name: sd}).nuisances()[name]
    assert column.shape == (6, 1)
    assert column == pytest.approx((high - low) / (2 * h), rel=1e-6)


def test_uncertain_mass_and_efficiency_have_closed_forms() -> None:
    free = replace(BENCH, friction_coefficient=0.0)
    columns = GunObservables(
        replace(record(), gun=free), {"bullet_mass_kg": 0.01, "tank_pressure_pa": 1e3}
    ).nuisances()
    mass, pressure = masses(record())[:6], np.repeat(PRESSURES, 2)
    assert columns["bullet_mass_kg"][:, 0] == pytest.approx(-0.005 / mass, rel=1e-4)
    assert columns["tank_pressure_pa"][:, 0] == pytest.approx(500 / pressure, rel=1e-4)
    ideal = replace(record(), gun=replace(BENCH, efficiency=1.0))
    assert GunObservables(ideal, {"efficiency": 0.02}).nuisances()["efficiency"] == pytest.approx(
        0.02, rel=1e-3
    )
    assert (
        GunObservables(record()).nuisances()
        == GunObservables(record(), {"travel_m": 0.0}).nuisances()
        == {}
    )


@pytest.mark.parametrize(
    "uncertain", [{"tank_volume": 1e-4}, {"travel_m": -0.01}, {"travel_m": float("nan")}]
)
def test_unknown_uncertainties_are_refused(uncertain: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(uncertain))):
        GunObservables(record(), uncertain)


@pytest.mark.parametrize(
    "identity", [*(e.id for e in GUN), "sensor.pressure_gain", "sensor.pressure_offset"]
)
def test_likely_values_are_allowed_and_few(identity: str) -> None:
    kind = catalogue()[identity]
    searched = {item.name: item.likely for item in kind.parameters() if item.likely is not None}
    assert all(1 <= len(names) <= 2 for names in kind.regimes or (tuple(searched),))
    for item in kind.parameters():
        low, high = item.likely or (item.low, item.high)
        assert item.low <= low < high <= item.high


def test_the_valve_opens_and_closes_by_each_configuration_s_profile() -> None:
    """By `gun_velocity` with the profile of one configuration; without a valve the law stays the
    nominal one."""
    six, text = record(), "0:0 0.1:1 0.12:1 0.16:0"
    first, *others = six.configurations
    stated = replace(
        six,
        configurations=(replace(first, factors={**first.factors, "valve_profile": text}), *others),
    )
    valve = effect("gun.valve_flow", loss_coefficient=20.0, opening_time_s=0.3)
    shown, usual = (GunObservables(of).simulated([valve])[:, 0] for of in (stated, six))
    rows = stated.configuration_of == 0
    profiles = [ValveProfile.parse(text)] * int(rows.sum())
    expected = gun_velocity(
        BENCH, pressures(six)[rows], masses(six)[rows], [valve], valve_profiles=profiles
    )
    assert shown[rows] == pytest.approx(np.log(expected.velocity_m_s), rel=1e-5)
    assert shown[~rows] == pytest.approx(usual[~rows], rel=1e-12)
    assert np.abs(shown[rows] - usual[rows]).min() > 1e-3
    np.testing.assert_allclose(
        GunObservables(stated).changes([[valve], []])[0][0],
        (shown - GunObservables(six).simulated()[:, 0])[rows][1:2],
        rtol=1e-3,
    )
    none = effect("gun.valve_flow", loss_coefficient=0.0, opening_time_s=0.3)
    np.testing.assert_allclose(
        GunObservables(stated).simulated([none]), GunObservables(six).simulated([none]), rtol=1e-12
    )


ROWS = np.array([2, 0, 0, 1])


def test_value_of_a_configuration_is_that_of_its_runs():
    own = at_rows([effect("gun.dead_volume", volume_m3=np.array([1e-4, 2e-4, 3e-4]))], ROWS)
    assert own[0].as_json()["volume_m3"] == [3e-4, 1e-4, 1e-4, 2e-4]
    effects = (effect("gun.dead_volume", volume_m3=1e-4), effect("sensor.velocity_gain", gain=1.1))
    assert at_rows(effects, ROWS) == effects
    valve = effect(
        "gun.valve_flow", loss_coefficient=np.array([1.0, 2.0, 3.0]), opening_time_s=0.01
    )
    parameters = at_rows([valve], ROWS)[0].as_json()
    assert parameters["loss_coefficient"] == [3.0, 1.0, 1.0, 2.0]
    assert parameters["opening_time_s"] == 0.01
    assert at_rows([], ROWS) == ()
    sets = stacked(
        [[effect("sensor.velocity_gain", gain=g)] for g in (1.1, np.array([1.2, 1.3]))], 2
    )
    assert sets[0].as_json()["gain"] == pytest.approx([1.1, 1.1, 1.2, 1.3])


def test_simulated_runs_have_their_configuration_s_value():
    """Run by run as if the whole campaign had the value of the run's configuration."""
    record = gun_record(pressures_pa=(0.5e5, 2e5), scatter=0.0)
    stage, gains = GunObservables(record), np.array([0.9, 1.0, 1.1, 1.2])
    together = stage.simulated(
        at_rows([effect("sensor.velocity_gain", gain=gains)], record.configuration_of)
    )
    alone = np.array(
        [
            stage.simulated([effect("sensor.velocity_gain", gain=float(gain))])[:, 0]
            for gain in gains
        ]
    )
    np.testing.assert_allclose(
        together[:, 0], alone[record.configuration_of, np.arange(len(record.runs))]
    )


def test_sets_of_the_same_kinds_are_observed_together():
    """Of one case each: the effects' numbers are what is observed."""
    calls = []

    def observed(effects, count):
        calls.append(([effect.id for effect in effects], count))
        values = [np.asarray(value) for effect in effects for value in vars(effect).values()]
        return sum(values, np.zeros(count))[:, None]

    loss, gain = effect("gun.dead_volume", volume_m3=2e-3), effect("sensor.velocity_gain", gain=1.1)
    sets = [[loss], [], [gain, loss], [effect("gun.dead_volume", volume_m3=1e-3)], [loss, gain]]
    assert batched_changes(np.zeros((1, 1)), sets, observed)[:, 0, 0] == pytest.approx(
        [0.002, 0.0, 1.102, 0.001, 1.102]
    )
    assert calls == [
        (["gun.dead_volume"], 2),
        (["gun.dead_volume", "sensor.velocity_gain"], 2),
    ]
