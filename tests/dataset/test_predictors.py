"""Sets of predictors, and the sources that they read."""

from __future__ import annotations

import re

import pytest
from pyroshock.dataset.predictors import SHIPPED, from_json, parse, predictors_named, shipped
from pyroshock.dataset.rows import polygon_area
from pyroshock.dataset.sources import PROPERTIES, ImpactSource, read_number
from support.records.pulse_tables import MATERIALS, PREDICTORS

STORE = {
    name: dict(zip((column for column, _ in PROPERTIES.values()), values, strict=True))
    for name, values in MATERIALS.items()
}


def case(numbers=None, **words: str) -> ImpactSource:
    return ImpactSource(words, numbers or {}, 1.2, 0.32, "aluminum", 0.01, 0.2)


def test_hammer_has_the_thirteen_of_table_4_3():
    assert shipped("hammer").predictors == PREDICTORS


def test_gun_has_the_masses_and_no_boundary_conditions():
    hammer, gun = ({p.name for p in shipped(name).predictors} for name in SHIPPED)
    assert gun - hammer == {"bullet_mass", "plate_mass"}
    assert hammer - gun == {"boundary_conditions"}


@pytest.mark.parametrize("name", SHIPPED)
def test_set_reads_back_from_json(name):
    assert from_json(shipped(name).as_json()) == shipped(name)


def test_own_file_is_read(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'name = "mine"\nkind = "hammer"\n[[predictors]]\nname = "mass"\nunit = "kg"\nfrom = "impactor.mass"\n'
    )
    assert predictors_named(str(path)).sources == ("impactor.mass",)


ENTRY = 'name = "a"\nkind = "hammer"\n[[predictors]]\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name = ", "not TOML"),
        ('name = "a"\nkind = "sled"\npredictors = []', "kind is 'sled'; expected one of hammer, gun"),
        ('name = "a"\nkind = "gun"\npredictors = []', "expected tables [[predictors]]"),
        ('name = "a"\nkind = "gun"\ncolour = 1\npredictors = []', "unknown key 'colour'; known: name, kind"),
        (ENTRY + 'name = "r"', "key 'from' is missing"),
        (ENTRY + 'name = "r"\nfrom = "tip.radius"', "from is 'tip.radius'; known: impact.velocity"),
        (ENTRY + 'name = "r"\nfrom = "factor."', "from is 'factor.'"),
        (ENTRY + 'name = "R m"\nfrom = "plate.mass"', "name is 'R m'; expected lower-case"),
        (ENTRY + 'name = "r"\nunit = "mm"\nfrom = "factor.tip_radius"', "unit is 'mm'; 'factor.tip_radius' is in 'm'"),
        (ENTRY + 'name = "v"\nfrom = "impact.velocity"', "'impact.velocity' is in 'm/s'"),
        (ENTRY + 'name = "i"\nfrom = "factor.insulator"', "is a word; expected its levels"),
        (ENTRY + 'name = "i"\nfrom = "tip.material"\nlevels = ["steel"]', "at least two"),
        (ENTRY + 'name = "r"\nfrom = "plate.mass"\nlevels = ["a", "b"]', "levels are for words"),
        (ENTRY + 'name = "r"\nfrom = "factor.x"\n[[predictors]]\nname = "r"\nfrom = "factor.y"', "given 2 times"),
    ],
)
def test_what_is_not_understood_is_refused(text, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        parse(text)


def test_unknown_set_is_named():
    with pytest.raises(LookupError, match="no predictors 'sled'; there are: hammer, gun"):
        predictors_named("sled")


@pytest.mark.parametrize(
    ("words", "target"),
    [
        ({"anvil_material": "none"}, "aluminum"),
        ({"anvil_material": "steel"}, "steel"),
        ({"anvil_material": "none", "plate_material": "steel"}, "steel"),
        ({}, None),
    ],
)
def test_target_is_the_first_layer_hit(words, target):
    assert case(**words).target == target
    found = read_number("target.density", case(**words), STORE)
    assert found == (MATERIALS[target][2] if target else None)


def test_plate_mass_is_area_times_thickness_times_density():
    assert read_number("plate.mass", case(plate_material="steel"), STORE) == pytest.approx(0.2 * 0.01 * 7800)


def test_stated_plate_mass_is_taken():
    assert read_number("plate.mass", case({"plate_mass_kg": 12.5}), STORE) == 12.5


def test_unknown_material_has_no_number():
    assert read_number("tip.density", case(tip_material="wood"), STORE) is None
    assert read_number("plate.mass", case(plate_material="wood"), STORE) is None


@pytest.mark.parametrize(
    ("corners", "area"),
    [([[0, 0], [2, 0], [2, 3], [0, 3]], 6.0), ([[0, 3], [2, 3], [2, 0], [0, 0]], 6.0), ([[1, 1], [4, 1], [1, 3]], 3.0)],
)
def test_area_of_a_polygon(corners, area):
    assert polygon_area(corners) == pytest.approx(area)
