"""The contact as a stage: strikes to pulses, with the spreads that its page tells."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyroshock.twin.contact.effects.layer_compliance import LayerCompliance
from pyroshock.twin.contact.effects.plastic_yield import PlasticYield
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.effects.viscous_loss import ViscousLoss
from pyroshock.twin.contact.hertz import hertz
from pyroshock.twin.contact.impacts import bodies_of, impedance
from pyroshock.twin.contact.laws import LAWS, hunt_crossley
from pyroshock.twin.contact.restitution_laws import LEAST
from pyroshock.twin.contact.stage import NO_SPREAD, SPREADS, LawContact, LawUncertainty
from pyroshock.twin.contact_interface import ContactStage, ImpactBatch
from pyroshock.twin.setting import THESIS, Setting

SETTING = Setting(
    0.5, THESIS["delrin"], 0.03, THESIS["aluminum"], 0.01, 5.0, impact_velocity_m_s=1.0
)
ANVIL = replace(SETTING, anvil=THESIS["steel"], insulator="polymeric")
STRIKES = ImpactBatch(
    [SETTING, ANVIL, replace(SETTING, tip=THESIS["steel"])], np.array([0.5, 2.0, 20.0])
)
STAGES = {
    **{law: LawContact(law) for law in LAWS},
    "hann, weir-tallon": LawContact("hann", "weir-tallon"),
    "effects": LawContact(
        effects=[ViscousLoss(0.05), LayerCompliance(1e-7), PlateCompliance(0.5), PlasticYield()]
    ),
}
every_stage = pytest.mark.parametrize("stage", STAGES.values(), ids=STAGES.keys())


@every_stage
def test_pulses_push_and_end_at_zero_and_zero_normals_are_their_mean(stage: ContactStage) -> None:
    """The same out of a pickle."""
    pulses, drawn = stage.pulses(STRIKES), stage.pulses(STRIKES, np.zeros((3, 1)))
    assert pulses.force_n.shape == (3, 65)
    assert np.all(pulses.force_n[:, [0, -1]] == 0)
    assert np.all(pulses.force_n >= 0)
    assert np.all(
        (pulses.compression_time_s > 0) & (pulses.compression_time_s < pulses.contact_time_s)
    )
    assert stage.normals == 1
    assert drawn.force_n == pytest.approx(pulses.force_n)
    assert drawn.contact_time_s == pytest.approx(pulses.contact_time_s)
    again = pickle.loads(pickle.dumps(stage))
    assert again.pulses(STRIKES).force_n == pytest.approx(pulses.force_n)


@pytest.mark.parametrize("name", [name for name in STAGES if name not in ("hunter", "reed")])
def test_sampled_impulse_is_the_momentum_exchanged(name: str) -> None:
    """Hunter and Reed know the tip's sphere only. No other pulse gives more than 2 m u, or less
    than m u."""
    momentum = 0.5 * STRIKES.impact_velocity_m_s
    share = STAGES[name].pulses(STRIKES).impulse_n_s / momentum
    assert np.all((share > 0.99) & (share < 2.001))


def test_slow_end_of_a_lossy_pulse_is_cut_and_strikes_do_not_meet() -> None:
    """With e = 0.01 the contact lasts 13 times the pulse: 65 phases of it would give half of its
    impulse."""
    law = hunt_crossley(bodies_of(STRIKES))
    assert law.restitution.value[2] == LEAST
    cut = LawContact("hunt-crossley").pulses(STRIKES)
    assert cut.contact_time_s[2] < 0.1 * law.contact_time_s[2]
    assert cut.impulse_n_s[2] == pytest.approx(law.impulse_n_s[2], rel=0.015)
    assert cut.peak_force_n[2] == pytest.approx(law.peak_force_n[2], rel=0.01)
    bodies = bodies_of(STRIKES)
    assert bodies.target_youngs_modulus_pa.tolist() == [69.9e9, 200e9, 69.9e9]
    assert impedance(STRIKES)[0] == impedance(STRIKES)[1]
    soft, hard = (
        LawContact(effects=effects).pulses(STRIKES) for effects in ([LayerCompliance(1e-6)], [])
    )
    assert (soft.peak_force_n < 0.9 * hard.peak_force_n).tolist() == [False, True, False]
    stage = STAGES["effects"]
    together = stage.pulses(STRIKES).force_n
    alone = [
        stage.pulses(ImpactBatch([setting], STRIKES.impact_velocity_m_s[k : k + 1])).force_n[0]
        for k, setting in enumerate(STRIKES.settings)
    ]
    assert together == pytest.approx(np.array(alone), rel=1e-9)


@pytest.mark.parametrize("law", LAWS)
def test_scatter_keeps_the_impulse_and_has_about_the_tables_mean_error(law: str) -> None:
    """Mean |predicted - measured| / measured, over 5,000 draws: the tables' quadratic mean of force
    and time."""
    rng = np.random.default_rng(1)
    strikes = ImpactBatch([SETTING] * 5_000, np.ones(5_000))
    stage = LawContact(law)
    mean, drawn = (
        stage.pulses(ImpactBatch([SETTING], np.ones(1))),
        stage.pulses(strikes, rng.standard_normal((5_000, 1))),
    )
    np.testing.assert_allclose(drawn.impulse_n_s, float(mean.impulse_n_s[0]), rtol=1e-9)
    force = np.mean(np.abs(mean.peak_force_n - drawn.peak_force_n) / drawn.peak_force_n)
    time = np.mean(np.abs(mean.contact_time_s - drawn.contact_time_s) / drawn.contact_time_s)
    table = sorted([SPREADS[law].force, SPREADS[law].time])
    assert 0.92 * table[0] < force < 1.08 * table[1]
    assert 0.92 * table[0] < time < 1.08 * table[1]


def test_small_spread_is_the_normals_own_and_none_takes_no_normals() -> None:
    """Of a small error s, sqrt(pi / 2) s; of two, their quadratic mean."""
    assert LawUncertainty(0.01, 0.01, "assumed").stretch == pytest.approx(
        np.sqrt(np.pi / 2) * 0.01, 1e-3
    )
    assert LawUncertainty(0.01, 0.02, "assumed").stretch == pytest.approx(
        np.sqrt(np.pi / 2 * 2.5e-4), 1e-3
    )
    stage = LawContact(spread=NO_SPREAD)
    assert stage.normals == 0
    assert stage.pulses(STRIKES, np.zeros((3, 0))).force_n == pytest.approx(
        stage.pulses(STRIKES).force_n
    )
    with pytest.raises(ValueError, match=r"z has shape \(2, 2\): expected \(3, 1\)"):
        LawContact().pulses(STRIKES, np.zeros((2, 2)))
    for field in ("force", "time"):
        with pytest.raises(ValueError, match=f"spread of {field} = -0.1"):
            replace(NO_SPREAD, **{field: -0.1})


def test_labels_say_what_answered_and_other_laws_are_refused() -> None:
    assert LawContact().label == "hertz"
    assert LawContact("hann", "weir-tallon").label == "hann + weir-tallon"
    assert LawContact(effects=[ViscousLoss(), PlasticYield()]).label == (
        "hertz + contact.viscous_loss + contact.plastic_yield"
    )
    with pytest.raises(ValueError, match="effects of the contact on 'hann': expected 'hertz'"):
        LawContact("hann", effects=[ViscousLoss()])
    with pytest.raises(LookupError, match="no law of contact 'herz'"):
        LawContact("herz")


def _told(stage: ContactStage) -> list[set[str]]:
    return [{item.predictor for item in each} for each in stage.outside(STRIKES)]


def test_what_lies_outside_is_told() -> None:
    """The slow delrin tip yields, too: at 0.5 m/s its peak pressure is 1.6 times its strength
    already. Effects that know a thing do not tell it, nor does an unknown strength of yield."""
    assert hertz(bodies_of(STRIKES)).peak_force_n[0] > 0
    velocity = {"impact_velocity_m_s"}
    assert _told(LawContact()) == [velocity, velocity | {"insulator"}, velocity]
    assert _told(LawContact("hunt-crossley"))[2] == velocity | {"restitution"}
    assert _told(LawContact(effects=[PlasticYield(), LayerCompliance()])) == [set(), set(), set()]
    gentle = replace(SETTING, tip=THESIS["polyurethane"])
    unknown = replace(SETTING, tip=replace(THESIS["delrin"], yield_strength_pa=None))
    for inside, speed in ((gentle, 0.2), (unknown, 9.0)):
        assert LawContact().outside(ImpactBatch([inside], np.array([speed]))) == [()]


PAGE = (
    Path(__file__).resolve().parents[3] / "docs" / "explanation" / "contact-effects.md"
).read_text(encoding="utf-8")


@pytest.mark.parametrize("law", SPREADS)
def test_every_spread_has_its_row(law: str) -> None:
    row = next(line for line in PAGE.splitlines() if f"`{law}`" in line and "%" in line)
    assert f"{100 * SPREADS[law].force:g} % | {100 * SPREADS[law].time:g} %" in row
