"""The contact stage on the modes of each setting's plate."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.effects.viscous_loss import ViscousLoss
from pyroshock.twin.contact.stage import NO_SPREAD, LawContact
from pyroshock.twin.contact_interface import ImpactBatch
from pyroshock.twin.coupled_contact import CoupledContact, point_of_plate
from pyroshock.twin.plate.modal import ModalPlate
from pyroshock.twin.plate.stage import PlateStage
from pyroshock.twin.setting import THESIS, Setting

MASS = 8.0
BASE = LawContact(spread=NO_SPREAD)


def plate(rigid=True, first_hz=120.0):
    frequency = np.array([0.0] * rigid + [first_hz, 300.0, 700.0])
    shape = np.array([MASS**-0.5] * rigid + [0.6, 0.4, 0.5])
    damping = np.where(frequency > 0, 0.005, 0.0)
    return ModalPlate(
        frequency,
        damping,
        np.stack([shape, 0.5 * shape]),
        shape[None],
        ("#1", "#2"),
        ("acceleration_1",),
    )


def setting(**changes):
    known = {"tip": THESIS["delrin"], "impact_velocity_m_s": 5.0, "plate": THESIS["aluminum"]}
    return Setting(
        0.5, tip_radius_m=0.03, plate_thickness_m=0.01, plate_mass_kg=MASS, **known | changes
    )


def strikes(*settings):
    return ImpactBatch(settings, np.array([setting.impact_velocity_m_s for setting in settings]))


@pytest.fixture(scope="module")
def stage():
    return CoupledContact(BASE, PlateStage({"aluminum": plate()}))


def test_plate_that_gives_way_takes_force_and_impulse(stage):
    coupled, rigid = (each.pulses(strikes(setting())) for each in (stage, BASE))
    assert coupled.peak_force_n[0] < 0.7 * rigid.peak_force_n[0]
    assert coupled.impulse_n_s[0] < 0.9 * rigid.impulse_n_s[0]
    assert coupled.force_n[0, 0] == coupled.force_n[0, -1] == 0
    middle, side = stage.pulses(strikes(setting(), setting(impact_position="#2"))).peak_force_n
    assert middle != side
    bare = CoupledContact(BASE, PlateStage({"aluminum": plate(rigid=False)}))
    free, fixed = bare.pulses(strikes(setting(), setting(boundary_conditions="fixed"))).peak_force_n
    assert free != fixed


def test_plate_compliance_does_not_count_twice(stage):
    """Nor does a part of it; the loss of the contact acts beside the modes, as the dashpot of a
    polymer does."""

    def pulses_with(*effects):
        return replace(stage, base=LawContact(effects=effects, spread=NO_SPREAD)).pulses(
            strikes(setting())
        )

    usual = stage.pulses(strikes(setting()))
    for share in (1.0, 0.3):
        assert np.array_equal(pulses_with(PlateCompliance(share)).force_n, usual.force_n)
    assert pulses_with(ViscousLoss(0.1)).impulse_n_s[0] < usual.impulse_n_s[0]
    assert (
        pulses_with(ViscousLoss(0.0, polymer_loss=0.3)).impulse_n_s[0] < 0.95 * usual.impulse_n_s[0]
    )


def test_free_plate_without_rigid_mode_moves_as_a_mass():
    bare, whole = plate(rigid=False), plate()
    names = ("frequency_hz", "shape")
    added, listed = (
        point_of_plate(bare, "#1", 3360.0, MASS),
        point_of_plate(whole, "#1", 3360.0, MASS),
    )
    assert all(
        np.allclose(getattr(added, name), getattr(listed, name), rtol=1e-14) for name in names
    )
    held = point_of_plate(bare, "#1", 3360.0)
    assert np.array_equal(held.frequency_hz, bare.frequency_hz)
    swinging = point_of_plate(
        replace(whole, frequency_hz=np.array([2.0, 120.0, 300.0, 700.0])), "#1", 3360.0, MASS
    )
    assert swinging.frequency_hz[0] == 2.0  # a rigid mode on its chains


def test_random_pulses_keep_the_balance_of_the_mean(stage):
    wide = replace(stage, base=LawContact())
    assert wide.normals == 1
    mean, high = wide.pulses(strikes(setting())), wide.pulses(strikes(setting()), np.array([[1.5]]))
    assert high.impulse_n_s[0] == pytest.approx(mean.impulse_n_s[0], rel=1e-9)
    assert high.peak_force_n[0] != mean.peak_force_n[0]


def test_chain_takes_it_as_any_contact_and_what_is_not_there_is_refused(stage):
    plates = PlateStage({"aluminum": plate()})
    twin = Twin(CoupledContact(LawContact(), plates), plate=plates)
    prediction = twin.predict(setting(), draws=8)
    assert prediction.models["contact"] == "hertz + modes of the plate"
    assert prediction.peak_force_n.mean > 0
    assert pickle.loads(pickle.dumps(stage)).pulses(strikes(setting())).force_n.shape == (1, 129)
    with pytest.raises(LookupError, match="no impact position '#9'"):
        stage.pulses(strikes(setting(impact_position="#9")))
    with pytest.raises(LookupError, match="no modes of a plate of 'steel'"):
        stage.pulses(strikes(setting(plate=THESIS["steel"])))
    with pytest.raises(ValueError, match="law 'hunter' on the modes of a plate: expected 'hertz'"):
        replace(stage, base=LawContact("hunter")).pulses(strikes(setting()))
