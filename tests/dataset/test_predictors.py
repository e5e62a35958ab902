"""Sets of predictors, the sources that they read, their correlation, and parts of a bench as rows
of the store."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
from pyroshock.dataset.predictors import (
    SHIPPED,
    correlation,
    from_json,
    parse,
    predictors_named,
    ranges,
    shipped,
)
from pyroshock.dataset.rows import gun_bench, modal_plate, polygon_area, stored_materials
from pyroshock.dataset.sources import PROPERTIES, ImpactSource, read_number
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.benches import Gun, ModalTable
from pyroshock.twin.gun.bench import GunBench
from pyroshock.twin.setting import THESIS
from sqlalchemy import select
from support.records.campaigns import gun_campaign
from support.records.plate_folders import plate_campaign, small_plate
from support.records.pulse_tables import MATERIALS, PREDICTORS, pulse_table
from support.stores.stores import opened

STORE = {
    name: dict(zip((column for column, _ in PROPERTIES.values()), values, strict=True))
    for name, values in MATERIALS.items()
}


def case(numbers=None, **words: str) -> ImpactSource:
    return ImpactSource(words, numbers or {}, 1.2, 0.32, "aluminum", 0.01, 0.2)


def test_sets_of_hammer_and_gun():
    assert shipped("hammer").predictors == PREDICTORS
    hammer, gun = ({p.name for p in shipped(name).predictors} for name in SHIPPED)
    assert gun - hammer == {"bullet_mass", "plate_mass"}
    assert hammer - gun == {"boundary_conditions"}


@pytest.mark.parametrize("name", SHIPPED)
def test_set_reads_back_from_json(name):
    assert from_json(shipped(name).as_json()) == shipped(name)


def test_own_file_is_read(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'name = "mine"\nkind = "hammer"\n[[predictors]]\nname = "mass"\nunit '
        '= "kg"\nfrom = "impactor.mass"\n'
    )
    assert predictors_named(str(path)).sources == ("impactor.mass",)
    with pytest.raises(LookupError, match="no predictors 'sled'; there are: hammer, gun"):
        predictors_named("sled")


ENTRY = 'name = "a"\nkind = "hammer"\n[[predictors]]\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name = ", "not TOML"),
        (
            'name = "a"\nkind = "sled"\npredictors = []',
            "kind is 'sled'; expected one of hammer, gun",
        ),
        ('name = "a"\nkind = "gun"\npredictors = []', "expected tables [[predictors]]"),
        (
            'name = "a"\nkind = "gun"\ncolour = 1\npredictors = []',
            "unknown key 'colour'; known: name, kind",
        ),
        (ENTRY + 'name = "r"', "key 'from' is missing"),
        (ENTRY + 'name = "r"\nfrom = "tip.radius"', "from is 'tip.radius'; known: impact.velocity"),
        (ENTRY + 'name = "r"\nfrom = "factor."', "from is 'factor.'"),
        (ENTRY + 'name = "R m"\nfrom = "plate.mass"', "name is 'R m'; expected lower-case"),
        (
            ENTRY + 'name = "r"\nunit = "mm"\nfrom = "factor.tip_radius"',
            "unit is 'mm'; 'factor.tip_radius' is in 'm'",
        ),
        (ENTRY + 'name = "v"\nfrom = "impact.velocity"', "'impact.velocity' is in 'm/s'"),
        (ENTRY + 'name = "i"\nfrom = "factor.insulator"', "is a word; expected its levels"),
        (ENTRY + 'name = "i"\nfrom = "tip.material"\nlevels = ["steel"]', "at least two"),
        (ENTRY + 'name = "r"\nfrom = "plate.mass"\nlevels = ["a", "b"]', "levels are for words"),
        (
            ENTRY + 'name = "r"\nfrom = "factor.x"\n[[predictors]]\nname = "r"\nfrom = "factor.y"',
            "given 2 times",
        ),
    ],
)
def test_what_is_not_understood_is_refused(text, said):
    with pytest.raises(ValueError, match=re.escape(said)):
        parse(text)


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


def test_plate_mass_is_stated_or_area_times_thickness_times_density():
    assert read_number("plate.mass", case(plate_material="steel"), STORE) == pytest.approx(
        0.2 * 0.01 * 7800
    )
    assert read_number("plate.mass", case({"plate_mass_kg": 12.5}), STORE) == 12.5
    assert read_number("tip.density", case(tip_material="wood"), STORE) is None
    assert read_number("plate.mass", case(plate_material="wood"), STORE) is None


@pytest.mark.parametrize(
    ("corners", "area"),
    [
        ([[0, 0], [2, 0], [2, 3], [0, 3]], 6.0),
        ([[0, 3], [2, 3], [2, 0], [0, 0]], 6.0),
        ([[1, 1], [4, 1], [1, 3]], 3.0),
    ],
)
def test_area_of_a_polygon(corners, area):
    assert polygon_area(corners) == pytest.approx(area)


TABLE = pulse_table(np.random.default_rng(2))


def test_matrix_is_numpys_and_materials_hang_together():
    varied = TABLE.x / TABLE.x.max(axis=0)
    every = correlation(TABLE)
    assert np.allclose(every.matrix, np.corrcoef(varied.T), atol=1e-12)
    # Section 4.2.1: E, nu and yield strength of the plates are correlated by 1 and -1, for there
    # are two.
    columns = [
        every.names.index(f"plate_{name}")
        for name in ("youngs_modulus", "poisson_ratio", "yield_strength")
    ]
    assert np.allclose(
        every.matrix[np.ix_(columns, columns)], [[1, -1, 1], [-1, 1, -1], [1, -1, 1]]
    )
    on_steel = correlation(TABLE.take(TABLE.target_material == "steel"))
    density = on_steel.names.index("plate_density")  # which never varied: nothing is known of it
    assert np.all(np.isnan(on_steel.matrix[density])) and np.all(
        np.isnan(on_steel.matrix[:, density])
    )
    assert on_steel.as_json()["correlation"][density] == [None] * len(on_steel.names)
    json.dumps(on_steel.as_json(), allow_nan=False)


def test_ranges_and_counts():
    rows = {row["predictor"]: row for row in ranges(TABLE)}
    velocity = TABLE.column("impact_velocity")
    assert (rows["impact_velocity"]["min"], rows["impact_velocity"]["max"]) == (
        velocity.min(),
        velocity.max(),
    )
    assert rows["tip_radius"]["distinct"] == 2
    assert rows["anvil_material"]["levels"] == {"none": 120, "aluminum": 240, "steel": 240}


def test_gun_and_modal_table_come_back(tmp_path: Path) -> None:
    with opened(f"sqlite:///{tmp_path}/lab.db", create=True) as store:
        ingest_folder(store, gun_campaign(tmp_path / "gun"))
        ingest_folder(store, plate_campaign(tmp_path / "plate", recordings=1).folder)
        with store.reading() as session:
            gun = gun_bench(session.scalars(select(Gun)).one())
            plate = modal_plate(session.scalars(select(ModalTable)).one())
    assert gun == GunBench(0.0095, 0.049, 0.048, 0.9, 1.4, 1.4, 0.5)
    assert (plate.sensors, plate.impact_points) == (
        small_plate().sensors,
        small_plate().impact_points,
    )
    for name in ("frequency_hz", "damping_ratio", "shape_impact", "shapes"):
        np.testing.assert_allclose(getattr(plate, name), getattr(small_plate(), name), rtol=1e-9)


def test_materials_go_by_name_and_alias_in_any_case(tmp_path: Path) -> None:
    with opened(f"sqlite:///{tmp_path}/lab.db", create=True) as store, store.reading() as session:
        materials = stored_materials(session)
    assert materials["pla"] == THESIS["PLA"]
    assert materials["aluminium"] == materials["aluminum"] == THESIS["aluminum"]
