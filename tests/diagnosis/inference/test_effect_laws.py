"""Laws of every effect in the catalogue: their ranges, their priors, and what levels of an owner
have in common."""

from __future__ import annotations

from dataclasses import make_dataclass

import numpy as np
import pytest
from pyroshock.diagnosis.inference.effect_laws import (
    COMMON_SHARE,
    LIKELY_SD,
    EffectLaw,
    LawRanges,
    laws_of,
    owners_of,
)
from pyroshock.diagnosis.observables.contact.stage import ContactObservables
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.twin.effects import Effect, catalogue, parameter
from support.records.contact_campaigns import hammer_record
from support.records.gun_campaigns import gun_record

#: Three configurations with two levels of every owner.
OWNER_NAMES = (
    "bench",
    "bullet",
    "tip",
    "face",
    "layer",
    "plate",
    "mode band",
    "channel",
    "session",
)
OWNERS = dict.fromkeys(OWNER_NAMES, ((0, 1, 0), ("first", "second")))
KINDS = [
    kind
    for kind in catalogue().values()
    if any(item.likely is not None for item in kind.parameters())
]
#: Effects of plates and sensors take numbers alone.
LAWS = [
    law
    for kind in KINDS
    for law in laws_of(kind, LawRanges(), OWNERS if kind.stage() in ("gun", "contact") else {})
]
SINGLE = [law for law in LAWS if not law.levels]
BY_LEVEL = pytest.mark.parametrize(
    "law", [law for law in LAWS if law.levels], ids=lambda law: law.key
)
ALL_KINDS = pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.id)


def of_kind(kind, laws=LAWS) -> list[EffectLaw]:
    return [law for law in laws if law.kind is kind]


@ALL_KINDS
def test_values_and_starts_stay_in_the_allowed_range(kind):
    for law in of_kind(kind):
        for place in np.linspace(-4.5, 4.5, 19):
            law.effect(np.full(law.size, place))  # raises outside of the range
            for coordinate in law.coordinates:
                value = float(coordinate.value(np.array(place)))
                assert coordinate.parameter.low <= value <= coordinate.parameter.high
    for law in of_kind(kind):
        for u in [*law.starts(), law.smallest_start()]:
            assert u.shape == (law.size,)
            law.effect(u)


@ALL_KINDS
def test_laws_of_a_kind_are_told_apart_and_share_its_prior(kind):
    for law in of_kind(kind, SINGLE):
        for coordinate in law.coordinates:
            for place in (-1.0, -0.3, 0.0, 0.7, 1.0):
                assert coordinate.place(float(coordinate.value(np.array(place)))) == pytest.approx(
                    place, abs=1e-9
                )
    for law in of_kind(kind):
        effect = law.effect(np.zeros(law.size))
        searched = {coordinate.parameter.name for coordinate in law.coordinates}
        for item in kind.parameters():
            if item.likely is not None and item.name not in searched:
                assert getattr(effect, item.name) == item.off
    assert sum(np.exp(law.log_prior) for law in of_kind(kind, SINGLE)) == pytest.approx(1.0)
    keys = [law.key for law in of_kind(kind)]
    assert len(set(keys)) == len(keys)
    # The first law is the data sheet's; at u = 1 a parameter is one typical error from its off
    # value.
    sheet = of_kind(kind, SINGLE)[0]
    for coordinate in sheet.coordinates:
        item = coordinate.parameter
        if item.typical is not None:
            assert float(coordinate.value(np.array(1.0))) - item.off == pytest.approx(item.typical)
            assert float(coordinate.value(np.array(0.0))) == pytest.approx(item.off)


@BY_LEVEL
def test_levels_share_what_their_law_has_in_common(law):
    # Derivatives of the levels' standardised values for u give their covariance: 1, and
    # COMMON_SHARE between two.
    width = 1 + len(law.level_names)
    for i, coordinate in enumerate(law.coordinates):
        slopes = []
        for column in range(width):
            u = np.zeros((len(law.coordinates), width))
            u[i, column] = 0.5
            values = np.asarray(law.values(u.ravel())[coordinate.parameter.name])
            slopes.append([coordinate.place(float(value)) / 0.5 for value in values])
        table = np.array(slopes)  # (1 + L, C)
        expected = np.array(
            [[1, COMMON_SHARE, 1], [COMMON_SHARE, 1, COMMON_SHARE], [1, COMMON_SHARE, 1]]
        )
        np.testing.assert_allclose(table.T @ table, expected, atol=1e-6)
    # With no part of their own all levels have the value of the common law at its common part.
    u = np.zeros((len(law.coordinates), 1 + len(law.level_names)))
    u[:, 0] = 0.8
    split, common = law.values(u.ravel()), law.common.values(law.common_part(u.ravel()))
    for name, value in common.items():
        np.testing.assert_allclose(split[name], value, rtol=1e-12)
    # Of all u with the same places, the one of least norm: it has no part that moves nothing.
    places = np.linspace(-0.9, 1.3, len(law.level_names))
    u = law.level_start(places).reshape(len(law.coordinates), -1)
    reached = np.sqrt(COMMON_SHARE) * u[0, 0] + np.sqrt(1 - COMMON_SHARE) * u[0, 1:]
    np.testing.assert_allclose(reached, places, atol=1e-12)
    idle = np.array([np.sqrt(1 - COMMON_SHARE), *np.full(len(places), -np.sqrt(COMMON_SHARE))])
    assert u[0] @ idle == pytest.approx(0.0, abs=1e-12)
    assert not u[1:].any()


@pytest.mark.parametrize(
    "stage", [GunObservables(gun_record()), ContactObservables(hammer_record(repetitions=1))]
)
def test_off_does_nothing(stage):
    effects = [
        [law.off()] for law in {law.id: law for law in LAWS}.values() if law.id in stage.shows
    ]
    assert len(effects) >= 5
    changes, tolerance = stage.changes(effects), [item.tolerance for item in stage.observables]
    assert np.nanmax(np.abs(changes) / tolerance) < 0.02


def test_parameter_that_is_off_at_zero_begins_at_its_smallest_visible_value():
    # `smallest` is where u = -2 lies, the likely end where u = 2 lies.
    kind = catalogue()["gun.dead_volume"]
    ranges = LawRanges({("gun.dead_volume", "volume_m3"): 1e-5})
    coordinate = laws_of(kind, ranges, {})[0].coordinates[0]
    assert float(coordinate.value(np.array(-LIKELY_SD))) == pytest.approx(1e-5)
    assert float(coordinate.value(np.array(LIKELY_SD))) == pytest.approx(3e-3)
    assert coordinate.one_sided
    laws = laws_of(catalogue()["sensor.pressure_offset"], LawRanges(), {})
    assert not any(law.coordinates[0].one_sided for law in laws)
    size = parameter("of nothing", "", default=1.0, low=0.0, high=2.0, off=0.0)
    kind = make_dataclass(
        "Fixed",
        [("size", float, size)],
        bases=(Effect,),
        namespace={"id": "gun.fixed"},
        frozen=True,
    )
    with pytest.raises(ValueError, match=r"gun\.fixed: no parameter has a likely range"):
        laws_of(kind, LawRanges(), {})
    # The test above looks at some.
    assert sum(item.typical is not None for kind in KINDS for item in kind.parameters()) >= 3


def test_shape_that_may_have_either_sign_is_searched_about_nothing():
    laws = {
        law.name: law for law in laws_of(catalogue()["sensor.acceleration_gain"], LawRanges(), {})
    }
    assert set(laws) == {"gain", "gain (gross)", "gain+fall", "gain+fall (gross)"}
    for name, spread in (("gain+fall", 0.025), ("gain+fall (gross)", 0.15)):
        gain, fall = laws[name].coordinates
        assert (fall.centre, fall.scale, fall.logarithmic) == (0.0, spread, False)
        assert gain.parameter.name == "gain"
        assert laws[name].off().as_json()["fall"] == 0.0
        assert laws[name].effect(np.array([0.0, 1.0])).as_json()["fall"] == pytest.approx(spread)


def test_owners_are_told_by_the_factors():
    owners = owners_of(
        [
            {
                "bullet_mass": 0.25,
                "tip_material": "steel",
                "plate_material": "aluminum",
                "insulator": "polymeric",
            },
            {
                "bullet_mass": 1.0,
                "tip_material": "steel",
                "plate_material": "steel",
                "insulator": "rubber",
            },
            {
                "bullet_mass": 0.25,
                "tip_material": "steel",
                "plate_material": "steel",
                "insulator": "rubber",
            },
        ]
    )
    assert owners == {
        "bullet": ((0, 1, 0), ("0.25", "1.0")),
        "plate": ((0, 1, 1), ("aluminum", "steel")),
        "face": ((0, 1, 1), ("aluminum", "steel")),
        "layer": ((0, 1, 1), ("polymeric", "rubber")),
    }
    rows = [
        {"anvil_material": "steel", "plate_material": "aluminum"},
        {"anvil_material": "none", "plate_material": "aluminum"},
    ]
    assert owners_of(rows)["face"] == ((1, 0), ("aluminum", "steel"))
    # A law of layers has no value where there is none.
    rows = [{"insulator": "polymeric"}, {"insulator": "none"}, {"insulator": "rubber"}]
    assert "layer" not in owners_of(rows)
    owners = {"bench": ((0, 0), ("one",))}
    assert all(not law.levels for kind in KINDS for law in laws_of(kind, LawRanges(), owners))
    # Seldom: it is said to belong to the bullet. What belongs to the target is not split by the
    # tip.
    laws = {
        law.name: law for law in laws_of(catalogue()["contact.effective_mass"], LawRanges(), OWNERS)
    }
    common, bullet, tip = (laws[f"mass_factor{end}"] for end in ("", " by bullet", " by tip"))
    assert len(laws) == 3
    assert common.log_prior > bullet.log_prior > tip.log_prior
    layer = laws_of(catalogue()["contact.layer_compliance"], LawRanges(), OWNERS)
    assert {law.name.partition(" by ")[2] for law in layer} == {"", "layer", "face", "plate"}
