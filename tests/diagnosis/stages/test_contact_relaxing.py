"""What a law of relaxation leaves open: how a pulse leans, and nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.evidence.surface import Surface, surfaces
from pyroshock.diagnosis.evidence.weighing import weigh
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.stages.contact import ContactStage
from pyroshock.diagnosis.stages.contact_features import NAMES
from pyroshock.diagnosis.stages.contact_relaxing import loose_relaxation
from pyroshock.twin.effects import catalogue, effect
from support.records.contact_campaigns import hammer_record

LEANING = np.isin(NAMES, ("rise_share", "skew", "shape_3"))
RELAXES = effect("contact.viscous_loss", loss_s_m=0.0, relaxing_loss=0.15, relaxing_stiffening=0.5)


def test_only_what_a_pulse_leans_by_is_open() -> None:
    change = np.random.default_rng(1).standard_normal((4, len(NAMES)))
    found = loose_relaxation([RELAXES], change)
    assert found is not None
    np.testing.assert_allclose(found[:, LEANING], np.abs(change[:, LEANING]))
    assert (found[:, ~LEANING] == 0).all()


@pytest.mark.parametrize(
    "other", [effect("contact.viscous_loss", loss_s_m=0.3), effect("contact.effective_mass", mass_factor=1.2)]
)
def test_other_laws_are_definite(other: object) -> None:
    assert loose_relaxation([other], np.ones((2, len(NAMES)))) is None


@pytest.mark.parametrize(
    ("lean", "loss", "stiffening"), [pytest.param(0.3, 0.45, 0.8, marks=pytest.mark.slow), (-0.5, 0.3, 0.5)]
)
def test_relaxation_is_found_whatever_the_pulse_leans_by(lean: float, loss: float, stiffening: float) -> None:
    """A loss whose pulses lean by less than the law's one time of relaxation says. A law that is taken at its word is
    refused for it, and another cause named."""
    record = hammer_record()
    stage = ContactStage(record)
    gap = GapTable.of(record, (stage,))
    relaxes = effect("contact.viscous_loss", loss_s_m=0.0, relaxing_loss=loss, relaxing_stiffening=stiffening)
    change = stage.changes([[relaxes]])[0]
    change[:, LEANING] *= lean
    seen = replace(gap, mean=change[gap.rows])
    sheets = surfaces((stage,), list(catalogue().values()))
    assert first(seen, sheets) == "contact.viscous_loss"
    assert first(seen, [replace(one, loose=None) for one in sheets]) != "contact.viscous_loss"


def first(gap: GapTable, sheets: Sequence[Surface]) -> str:
    return next(iter(weigh(Scene.of(gap, sheets)).probability))
