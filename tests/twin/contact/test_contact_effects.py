"""Effects of the contact: off is Hertz, each does what its law says, and only where it acts."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact.bodies import MissingQuantityError
from pyroshock.twin.contact.effects.effective_mass import EffectiveMass
from pyroshock.twin.contact.effects.layer_compliance import LayerCompliance
from pyroshock.twin.contact.effects.plastic_yield import PlasticYield
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.effects.tip_geometry import TipGeometry
from pyroshock.twin.contact.effects.viscous_loss import ViscousLoss
from pyroshock.twin.contact.hertz import hertz, restitution_of, yield_load, yield_velocity
from pyroshock.twin.contact.impact import impact
from pyroshock.twin.contact.impacts import ContactEffect, Impacts
from pyroshock.twin.effects import catalogue
from support.records.contact_bodies import impacts

EFFECTS = {name: kind for name, kind in catalogue().items() if issubclass(kind, ContactEffect)}
every_effect = pytest.mark.parametrize("kind", EFFECTS.values(), ids=EFFECTS.keys())

BODIES = impacts(impact_velocity_m_s=[0.3, 1.2, 5.0])
INSULATED = np.array([True, False, True])


@every_effect
def test_off_is_hertz_and_parameters_are_one_for_each_impact(kind: type[ContactEffect]) -> None:
    """Parameters of other impacts are refused."""
    off = kind(**{item.name: item.off for item in kind.parameters()})
    nominal = impact(BODIES, insulated=INSULATED)
    assert np.array_equal(
        impact(BODIES, [off], insulated=INSULATED).force_n(33), nominal.force_n(33)
    )
    changed = impact(BODIES, [kind()], insulated=np.ones(3, dtype=bool)).peak_force_n
    assert not np.allclose(changed, hertz(BODIES).peak_force_n, rtol=1e-3)
    wrong = kind(**{item.name: np.full(2, item.default) for item in kind.parameters()})
    with pytest.raises(ValueError, match=f"{kind.id}: parameter of shape"):
        impact(BODIES, [wrong])
    items = kind.parameters()
    each = kind(**{item.name: np.linspace(item.default, item.off, 3) for item in items})
    together = impact(BODIES, [each], insulated=np.ones(3, dtype=bool)).peak_force_n
    for row in range(3):
        one = kind(
            **{item.name: float(np.linspace(item.default, item.off, 3)[row]) for item in items}
        )
        alone = impact(
            impacts(impact_velocity_m_s=BODIES.impact_velocity_m_s[row]),
            [one],
            insulated=np.array([True]),
        )
        assert alone.peak_force_n[0] == pytest.approx(together[row], rel=1e-9)


def test_viscous_loss_has_its_restitution_for_any_tip_and_layer() -> None:
    """The motion's integral knows only the work: a (1 + e) = ln((1 + a) / (1 - e a)) for every
    elastic curve. Small losses grow with the velocity: eq. 1.19 with alpha = (2/3) chi."""
    velocity = BODIES.impact_velocity_m_s
    effect = ViscousLoss(0.4)
    found = impact(BODIES, [effect]).restitution.value
    assert found == pytest.approx(effect.restitution(velocity), rel=1e-6)
    assert found == pytest.approx(restitution_of(0.4 * velocity), rel=1e-6)
    others = [effect, TipGeometry(1.1), LayerCompliance(1e-7), EffectiveMass(2.0)]
    beside_others = impact(BODIES, others, insulated=np.ones(3, dtype=bool)).restitution.value
    assert beside_others == pytest.approx(effect.restitution(velocity), rel=2e-6)
    wanted = np.array([0.3, 0.6, 0.9])
    matched = impact(BODIES, [ViscousLoss.of_restitution(wanted, velocity)]).restitution.value
    assert matched == pytest.approx(wanted, rel=1e-6)
    loss = 1 - impact(BODIES, [ViscousLoss(0.003)]).restitution.value
    assert loss == pytest.approx(2 / 3 * 0.003 * velocity, rel=0.02)


def test_layer_acts_where_the_insulator_is_and_gives_way_less_where_it_stiffens() -> None:
    pulse, nominal = (
        impact(BODIES, effects, insulated=INSULATED) for effects in ([LayerCompliance(1e-7)], [])
    )
    softer = pulse.peak_force_n < 0.99 * nominal.peak_force_n
    assert softer.tolist() == INSULATED.tolist()
    assert pulse.force_n()[1] == pytest.approx(nominal.force_n()[1], rel=1e-12)
    # The same loss of peak at the slowest blow: a linear layer takes more at faster ones, a
    # stiffening one less.
    insulated = np.ones(3, dtype=bool)
    linear, stiff, none = (
        impact(BODIES, effects, insulated=insulated).peak_force_n
        for effects in ([LayerCompliance(3e-8)], [LayerCompliance(3e-8, stiffening_1_n=1e-2)], [])
    )
    linear, stiff = linear / none, stiff / none
    assert np.all(np.diff(linear) < 0)
    assert np.all(stiff > linear)
    assert stiff[2] - linear[2] > 2 * (stiff[0] - linear[0])


def test_what_relaxes_is_like_polymers_of_all_materials() -> None:
    """Where tip and face are polymers the two laws are one; where they are metals only one of them
    acts."""
    soft = impacts(
        impact_velocity_m_s=[0.3, 1.2],
        impactor_youngs_modulus_pa=np.full(2, 3e9),
        target_youngs_modulus_pa=np.full(2, 2e9),
    )
    relaxing, polymer = (
        ViscousLoss(0, relaxing_loss=0.2, relaxing_stiffening=0.5),
        ViscousLoss(0, 0.2, 0.5),
    )
    assert impact(soft, [relaxing]).force_n() == pytest.approx(
        impact(soft, [polymer]).force_n(), rel=1e-12
    )
    metals = impacts(
        impact_velocity_m_s=[0.3, 1.2],
        impactor_youngs_modulus_pa=np.full(2, 200e9),
        target_youngs_modulus_pa=np.full(2, 70e9),
    )
    assert impact(metals, [polymer]).force_n() == pytest.approx(impact(metals).force_n(), rel=1e-12)
    assert np.all(impact(metals, [relaxing]).restitution.value < 0.9)


def test_yield_stiffness_plate_and_mass_act_as_they_say() -> None:
    """Hertz: the time goes with k^(-2/5), the peak with k^(2/5)."""
    nominal, found = impact(BODIES), impact(BODIES, [ViscousLoss(0, relaxing_stiffening=0.5)])
    assert found.contact_time_s / nominal.contact_time_s == pytest.approx([1.5**-0.4] * 3, rel=1e-5)
    assert found.peak_force_n / nominal.peak_force_n == pytest.approx([1.5**0.4] * 3, rel=1e-5)
    stiffer = impact(BODIES, [PlateCompliance()], plate_impedance_n_s_m=np.full(3, 1e6))
    assert stiffer.restitution.value == pytest.approx(1.0, abs=0.01)
    assert np.all(impact(BODIES, [PlateCompliance()]).restitution.value < 0.9)
    heavier = impact(BODIES, [EffectiveMass(1.5)])
    assert heavier.impulse_n_s == pytest.approx(1.5 * hertz(BODIES).impulse_n_s, rel=1e-7)
    assert heavier.peak_force_n == pytest.approx(1.5**0.6 * hertz(BODIES).peak_force_n, rel=1e-7)
    # Johnson, eq. 4.24: p0 = (6 F E*^2 / (pi^3 R^2))^(1/3); delrin yields before aluminium.
    velocity = yield_velocity(impacts())[0]
    bodies = impacts(impact_velocity_m_s=velocity * np.array([0.99, 1.01]))
    below, above = impact(bodies, [PlasticYield()]).permanent_indentation_m
    assert below == 0.0 < above
    pressure = (
        6 * yield_load(impacts()) / (np.pi**3 * 0.03**2 * impacts().compliance_1_pa ** 2)
    ) ** (1 / 3)
    assert pressure == pytest.approx([1.6 * 71.7e6])


@pytest.mark.parametrize("polymer", ["tip", "face"])
def test_polymers_act_by_their_share_of_the_compliance(polymer: str) -> None:
    compliance = {"tip": (1 - 0.4**2) / 3e9, "face": (1 - 0.3**2) / 60e9}
    bodies = {
        "impactor_youngs_modulus_pa": 3e9,
        "impactor_poisson_ratio": 0.4,
        "target_youngs_modulus_pa": 60e9,
        "target_poisson_ratio": 0.3,
    }
    if polymer == "face":  # the other way about
        names = [*list(bodies)[2:], *list(bodies)[:2]]
        bodies = dict(zip(names, bodies.values(), strict=True))
    stiffer = 1 + 2.0 * compliance["tip"] / sum(compliance.values())
    nominal, found = (
        impact(impacts(**bodies)),
        impact(impacts(**bodies), [ViscousLoss(0, polymer_stiffening=2.0)]),
    )
    assert found.contact_time_s / nominal.contact_time_s == pytest.approx([stiffer**-0.4], rel=1e-5)


def test_what_relaxes_loses_the_same_at_any_speed_mass_and_stiffness() -> None:
    """As Zener says, e = exp(-1.72 lambda) for little of it (Phys. Rev. 59 (1941) 669). With a flat
    tip it is a mass on a Maxwell body, p = 1: f'' + lambda f' + f = 0, whence e = exp(-lambda pi /
    sqrt(4 - lambda^2))."""
    bodies = impacts(impact_velocity_m_s=[0.3, 5.0, 0.3], impactor_mass_kg=[0.32, 0.32, 4.0])
    found = [
        impact(bodies, [ViscousLoss(0, relaxing_loss=0.1, relaxing_stiffening=s)])
        for s in (0.0, 3.0)
    ]
    e = np.array([one.restitution.value for one in found])
    assert e == pytest.approx(np.full((2, 3), e[0, 0]), rel=1e-6)
    assert e[0, 0] == pytest.approx(np.exp(-0.172), rel=5e-3)
    inelasticity = np.array([0.05, 0.3, 1.0])
    flat = impact(bodies, [TipGeometry(exponent=1.0), ViscousLoss(0, relaxing_loss=inelasticity)])
    expected = np.exp(-inelasticity * np.pi / np.sqrt(4 - inelasticity**2))
    assert flat.restitution.value == pytest.approx(expected, rel=1e-5)
    for exponent in (1.0, 1.2, 2.0):
        relaxing = impact(
            bodies, [TipGeometry(exponent=exponent), ViscousLoss(0, relaxing_loss=0.2)]
        ).restitution.value
        assert relaxing == pytest.approx(np.full(3, relaxing[0]), rel=1e-6)


def test_contact_that_springs_back_at_once_ends_after_its_deepest_indentation() -> None:
    """A pointed steel tip that yields: what springs back is far shorter than what was pressed
    in."""
    steel = {
        "impactor_youngs_modulus_pa": 2e11,
        "target_youngs_modulus_pa": 2e11,
        "impactor_yield_strength_pa": 4e8,
        "target_yield_strength_pa": 4e8,
        "impactor_mass_kg": 0.5,
        "impactor_radius_m": 0.045,
    }
    pointed = TipGeometry(exponent=2.62041930178646, reference_indentation_m=7.554626260509687e-06)
    relaxing = ViscousLoss(
        0, relaxing_loss=0.9774522627339214, relaxing_stiffening=0.028208421853817823
    )
    effects = [
        EffectiveMass(1.1159665200641904),
        PlasticYield(1.9032368468171748),
        pointed,
        relaxing,
    ]
    fast = impact(impacts(impact_velocity_m_s=np.geomspace(10, 20, 500), **steel), effects)
    assert np.all(np.abs(np.diff(np.log(fast.contact_time_s))) < 1e-3)
    faster = impact(impacts(impact_velocity_m_s=np.geomspace(20, 100, 500), **steel), effects)
    assert np.all(faster.contact_time_s > faster.compression_time_s)
    assert np.all(faster.force_n() >= 0)


def test_missing_quantities_and_effects_of_other_stages_are_refused() -> None:
    with pytest.raises(
        MissingQuantityError, match=r"contact.plastic_yield needs target_yield_strength_pa"
    ):
        impact(impacts(target_yield_strength_pa=None), [PlasticYield()])
    with pytest.raises(
        MissingQuantityError, match=r"contact.plate_compliance needs plate_thickness_m"
    ):
        impact(impacts(plate_thickness_m=None), [PlateCompliance()])
    other = next(kind for kind in catalogue().values() if not issubclass(kind, ContactEffect))
    with pytest.raises(TypeError, match="expected effects of ContactEffect"):
        impact(BODIES, [other()])
    assert list(EFFECTS) == [name for name in catalogue() if name.startswith("contact.")]


def test_worn_tip_keeps_the_force_at_its_reference() -> None:
    """An impact that comes just to the reference has the ball's peak where the energies are the
    same."""
    depth = 2e-4
    stiffness = impacts().hertz_stiffness_n_m15
    energy = (
        stiffness * depth**2.5 / (1.2 + 1)
    )  # of the worn tip at that depth: k d^(3/2 - p) d^(p + 1) / (p + 1)
    bodies = impacts(impact_velocity_m_s=np.sqrt(2 * energy / 0.32))
    pulse = impact(bodies, [TipGeometry(1.2, depth)])
    assert pulse.deepest_indentation_m == pytest.approx([depth], rel=1e-6)
    assert pulse.peak_force_n == pytest.approx(stiffness * depth**1.5, rel=1e-6)


def test_yield_that_hardens_as_an_elastic_contact_is_hertz() -> None:
    """With r = p nothing is left and nothing lost, of balls and of flat tips; a larger r acts as
    p."""
    soft, nominal = PlasticYield(0.5, hardening_exponent=1.5), hertz(BODIES)
    pulse = impact(BODIES, [soft])
    assert pulse.restitution.value == pytest.approx(1.0, abs=1e-6)
    assert pulse.permanent_indentation_m == pytest.approx(0.0, abs=1e-12)
    for name in ("peak_force_n", "contact_time_s", "compression_time_s"):
        assert getattr(pulse, name) == pytest.approx(getattr(nominal, name), rel=1e-6)
    for exponent in (1.0, 1.2):
        worn = TipGeometry(exponent)
        for order in ([worn, soft], [soft, worn]):
            assert impact(BODIES, order).peak_force_n == pytest.approx(
                impact(BODIES, [worn]).peak_force_n, rel=1e-6
            )


@pytest.mark.parametrize("pressure", [0.4, 1.6])
def test_less_hardening_lowers_the_peak_and_rebound_and_lengthens_the_contact(
    pressure: float,
) -> None:
    exponents = np.linspace(0.2, 1.5, 14)
    bodies = impacts(impact_velocity_m_s=np.full(14, 5.0))
    pulse = impact(bodies, [PlasticYield(pressure, hardening_exponent=exponents)])
    assert np.all(np.diff(pulse.peak_force_n) > 0)
    assert np.all(np.diff(pulse.restitution.value) > 0)
    assert np.all(np.diff(pulse.contact_time_s) < 0)
    assert np.all(np.diff(pulse.permanent_indentation_m) < 0)
    straight = impact(bodies, [PlasticYield(pressure)])
    assert np.all((pulse.peak_force_n < straight.peak_force_n) == (exponents < 1))


def test_an_earlier_yield_keeps_its_own_hardening_and_impossible_exponents_are_refused() -> None:
    early, late = (
        PlasticYield(0.5, hardening_exponent=1.2),
        PlasticYield(2.0, hardening_exponent=0.5),
    )
    early_inputs = early.prepare(Impacts.of(BODIES))
    for prepared in (early.prepare(late.prepare(Impacts.of(BODIES))), late.prepare(early_inputs)):
        assert np.array_equal(prepared.yield_load_n, early_inputs.yield_load_n)
        assert prepared.hardening_exponent.tolist() == [1.2] * 3
    for exponent in (0.1, 1.6, -1.0, float("nan")):
        refusal = rf"contact\.plastic_yield: hardening_exponent = {exponent}; expected 0\.2 to 1\.5"
        with pytest.raises(ValueError, match=refusal):
            PlasticYield(hardening_exponent=exponent)


def test_yield_without_a_hardening_of_its_own_is_along_the_tangent() -> None:
    thornton, told = (
        impact(BODIES, [yields])
        for yields in (PlasticYield(), PlasticYield(hardening_exponent=1.0))
    )
    assert np.array_equal(thornton.force_n(65), told.force_n(65))
    near = impact(BODIES, [PlasticYield(hardening_exponent=1.0 + 1e-9)])
    assert near.force_n(65) == pytest.approx(
        thornton.force_n(65), rel=1e-6, abs=1e-6 * thornton.peak_force_n.max()
    )
