"""The validity domain: what was recorded is inside, what never was is told by name."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.dataset.domain import Domain
from pyroshock.dataset.table import Inputs, Predictor, split_of
from support.records.pulse_tables import MATERIALS, PREDICTORS, inputs_at, pulse_table

TABLE = pulse_table(np.random.default_rng(3))
DOMAIN = Domain.of(TABLE)
ONE = TABLE.take(slice(0, 1))  # an aluminium tip on the bare plate, free, at low speed
TIP = ("tip_youngs_modulus", "tip_poisson_ratio", "tip_density", "tip_yield_strength")


def told(domain: Domain, inputs: Inputs):
    """Names of what is outside for the only impact."""
    (found,) = domain.outside(inputs)
    return [one.predictor for one in found]


def numbers(x, *names: str) -> Inputs:
    """Inputs of plain numbers (n x d)."""
    x = np.asarray(x, dtype=np.float64)
    return Inputs(tuple(map(Predictor, names)), x, np.full(len(x), np.nan), np.full(len(x), np.nan))


@pytest.mark.parametrize("text", ["repetitions", "configurations", "treatments", "material=steel"])
@pytest.mark.parametrize("seed", [0, 1])
def test_no_training_row_is_outside(text, seed):
    train = TABLE.take(split_of(TABLE, text, seed).train)
    assert not any(Domain.of(train).outside(train))


@pytest.mark.parametrize("velocity", [0.0, 9.0])
def test_speed_beyond_the_recorded_is_told(velocity):
    (found,) = DOMAIN.outside(inputs_at(ONE, impact_velocity=velocity))
    assert [one.predictor for one in found] == ["impact_velocity"]
    assert found[0].range == (
        TABLE.column("impact_velocity").min(),
        TABLE.column("impact_velocity").max(),
    )
    assert found[0].value == velocity


def test_material_that_was_never_hit_and_a_mixture_of_tips_are_told():
    # Titanium lies between aluminium and steel in every property: two materials say nothing of a
    # third.
    names = ("plate_youngs_modulus", "plate_poisson_ratio", "plate_density", "plate_yield_strength")
    found = told(
        DOMAIN, inputs_at(ONE, **dict(zip(names, (114e9, 0.32, 4430.0, 350e6), strict=True)))
    )
    assert found == list(names)
    # Each property of a tip that lies between the three recorded ones, though no such tip was
    # recorded.
    mixed = dict(zip(TIP, (3.5e9, 0.34, 1240.0, 60e6), strict=True))
    (found,) = DOMAIN.outside(inputs_at(ONE, **mixed))
    assert len(found) == 1
    assert found[0].predictor.startswith("tip_")
    assert "off every combination" in found[0].reason
    for tip, radius in (("aluminum", 0.03), ("delrin", 0.03), ("polyurethane", 0.015)):
        asked = inputs_at(ONE, tip_radius=radius, **dict(zip(TIP, MATERIALS[tip], strict=True)))
        assert told(DOMAIN, asked) == []


def test_levels_that_never_met_are_told():
    (found,) = DOMAIN.outside(inputs_at(ONE, insulator=1))  # an insulator without an anvil
    (one,) = found
    assert {one.predictor, one.reason.split("together with ")[1].split()[0]} == {
        "anvil_material",
        "insulator",
    }
    assert one.value in ("none", "polymeric")
    rows = (TABLE.tip_material == "delrin") & (TABLE.target_material == "steel")
    outside = Domain.of(TABLE.take(~rows)).outside(TABLE.take(rows))
    assert all("never recorded together" in predictors[0].reason for predictors in outside)
    domain = Domain.of(TABLE.take(TABLE.column("boundary_conditions") == 0))
    (found,) = domain.outside(inputs_at(ONE, boundary_conditions=1))
    assert [(one.predictor, one.value, one.range) for one in found] == [
        ("boundary_conditions", "fixed", ("free",))
    ]


@pytest.mark.parametrize("value", [0.5, 7, np.nan])
def test_value_that_is_no_level_is_told(value):
    assert told(DOMAIN, inputs_at(ONE, insulator=value)) == ["insulator"]


def test_unknown_value_and_another_hammer_are_told():
    (found,) = DOMAIN.outside(inputs_at(ONE, impact_velocity=np.nan))
    assert [one.reason for one in found] == ["is not known"]
    assert found[0].as_json()["value"] is None
    asked = replace(ONE.inputs, impactor_mass_kg=np.array([1.0]))
    assert told(DOMAIN, asked) == ["impactor_mass"]
    assert told(DOMAIN, replace(asked, impactor_mass_kg=np.array([np.nan]))) == []


def test_leverage_is_mahalanobis_distance_in_any_units():
    # Two correlated numbers: the corner that nobody recorded lies outside, by the number that
    # deviates more.
    rng = np.random.default_rng(0)
    a = rng.uniform(0, 1, 400)
    x = np.column_stack([a, a + 0.05 * rng.standard_normal(400)])
    domain = Domain.of(numbers(x, "a", "b"))
    z = (x - x.mean(axis=0)) / x.std(axis=0)
    inverse = np.linalg.inv(np.cov(z.T))
    limit = np.einsum("ni,ij,nj->n", z, inverse, z).max()
    asked = rng.uniform(0.05, 0.95, (500, 2))
    w = (asked - x.mean(axis=0)) / x.std(axis=0)
    far = np.einsum("ni,ij,nj->n", w, inverse, w) > limit
    assert [bool(one) for one in domain.outside(numbers(asked, "a", "b"))] == far.tolist()
    assert 0.2 < far.mean() < 0.95
    rng = np.random.default_rng(1)
    a = rng.standard_normal(200)
    x = np.column_stack([a, 0.9 * a + 0.1 * rng.standard_normal(200)])
    asked = rng.standard_normal((200, 2))
    scale = np.array([1e9, 1e-3])
    found = Domain.of(numbers(x, "a", "b")).outside(numbers(asked, "a", "b"))
    scaled = Domain.of(numbers(x * scale, "a", "b")).outside(numbers(asked * scale, "a", "b"))
    assert [[one.predictor for one in row] for row in found] == [
        [one.predictor for one in row] for row in scaled
    ]


def test_domain_reads_back_from_json():
    again = Domain.from_json(json.loads(json.dumps(DOMAIN.to_json(), allow_nan=False)))
    asked = TABLE.take(slice(0, 40)).inputs
    x = asked.x * np.random.default_rng(0).choice([1.0, 1.0, 1.0, 1.5], asked.x.shape)
    asked = replace(asked, x=x)
    assert again.outside(asked) == DOMAIN.outside(asked)
    assert again.predictors == PREDICTORS
    with pytest.raises(ValueError, match="inputs have predictors a; the domain is of tip_radius"):
        DOMAIN.outside(numbers([[1.0]], "a"))
    domain = Domain.of(ONE)
    assert domain.outside(ONE) == [()]
    assert told(domain, inputs_at(ONE, impact_velocity=5.0)) == ["impact_velocity"]
    split = split_of(TABLE, "repetitions")
    outside = Domain.of(TABLE.take(split.train)).outside(TABLE.take(split.test))
    assert sum(bool(pulse_reasons) for pulse_reasons in outside) <= 0.03 * len(outside)


@pytest.mark.parametrize("x", [np.zeros((0, 1)), [[np.nan]]])
def test_nothing_has_no_domain(x):
    with pytest.raises(ValueError, match="expected at least one"):
        Domain.of(numbers(x, "a"))


@pytest.mark.parametrize(
    "damage", [{"format": 9}, {"limits": 3}, {"met": [[1]]}, {"subspace": {}}, {"bench": [1]}]
)
def test_damaged_domain_is_refused(damage):
    with pytest.raises(ValueError, match="train the model anew"):
        Domain.from_json({**DOMAIN.to_json(), **damage})
