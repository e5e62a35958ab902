"""A dataset has impact velocities of one kind, or converts them by each pulse and the plate."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pyroshock.dataset.catalog import get_snapshot_row
from pyroshock.dataset.snapshot import build_snapshot, read_snapshot
from pyroshock.dataset.velocities import kind_of_snapshot
from pyroshock.schema.impacts import (
    BEFORE_CONTACT,
    INTEGRATED,
    KIND_OF_SOURCE,
    KINDS,
    TARGET_MOTION_ADDED,
    Impact,
    velocity_kind,
)
from pyroshock.schema.session import Store
from pyroshock.twin.contact.impacts import plate_impedance
from pyroshock.twin.contact.target_motion import PulseMoments, TargetMotion, velocity_before_contact
from pyroshock.twin.setting import THESIS
from sqlalchemy import update
from support.stores.hammer_stores import filled_store, full_campaign
from support.stores.stores import opened


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("filled")
    return filled_store(place, full_campaign(place / "spring"))


@pytest.fixture
def store(filled: Path, tmp_path: Path) -> Iterator[Store]:
    with opened(f"sqlite:///{shutil.copy(filled, tmp_path / 'lab.db')}") as store:
        yield store


def set_source(store: Store, source: str, *runs: int) -> None:
    store.write(
        lambda session: session.execute(
            update(Impact).where(Impact.run.in_(runs)).values(velocity_source=source)
        )
    )


def stated(store: Store, name: str) -> dict[str, object]:
    return dict(read_snapshot(store, name).definition["velocity"])


def test_every_source_has_a_kind_and_integrals_are_the_way_back(store: Store) -> None:
    assert set(KIND_OF_SOURCE.values()) == set(KINDS)
    assert velocity_kind(None) is None
    with pytest.raises(LookupError, match="velocity_source is 'guessed'; known: reported, laser, "):
        velocity_kind("guessed")
    raw = build_snapshot(store, "raw", ["spring"]).snapshot.table
    built = build_snapshot(store, "integrals", ["spring"], velocity="integrated").snapshot
    assert built.definition["velocity"]["kind"] == INTEGRATED
    assert np.all(built.table.column("impact_velocity") < raw.column("impact_velocity"))
    assert read_snapshot(store, "integrals").hash == built.hash


def test_dataset_states_the_kind_and_keeps_its_hash(store: Store) -> None:
    """What models see is the same: the kind changes no hash of a dataset that was built before
    kinds were stated."""
    first = build_snapshot(store, "first", ["spring"]).snapshot
    assert stated(store, "first") == {"kind": BEFORE_CONTACT, "converted": 0, "relative_u": None}
    set_source(store, "integrated", 1, 2, 3, 4)
    again = build_snapshot(store, "again", ["spring"])
    assert (again.added, again.snapshot.hash) == (False, first.hash)


def test_older_dataset_has_the_kind_of_most_of_its_impacts(store: Store) -> None:
    hash_ = build_snapshot(store, "old", ["spring"]).snapshot.hash
    set_source(store, "integrated", 1, 2, 3)
    with store.reading() as session:
        definition = {
            key: value
            for key, value in get_snapshot_row(session, "old").definition.items()
            if key != "velocity"
        }
        assert kind_of_snapshot(session, hash_, definition) == INTEGRATED


def test_two_kinds_and_unknown_choices_are_refused(store: Store) -> None:
    set_source(store, "integrated", 1)
    with pytest.raises(
        ValueError, match=r"15 before contact, 5 integrated to the peak.*--velocity before-contact"
    ):
        build_snapshot(store, "mixed", ["spring"])
    with pytest.raises(
        ValueError, match="velocity is 'true'; expected one of before-contact, integrated"
    ):
        build_snapshot(store, "x", ["spring"], velocity="true")


def test_integrated_velocities_are_converted_and_read_back(store: Store) -> None:
    raw = build_snapshot(store, "raw", ["spring"]).snapshot.table
    set_source(store, "integrated", 1, 2)
    built = build_snapshot(store, "true", ["spring"], velocity="before-contact").snapshot
    assert built.definition["velocity"]["kind"] == TARGET_MOTION_ADDED
    assert built.definition["velocity"]["converted"] == 10
    assert 0.02 < built.definition["velocity"]["relative_u"] < 1
    rows = raw.run <= 2
    before, after = raw.column("impact_velocity"), built.table.column("impact_velocity")
    np.testing.assert_array_equal(after[~rows], before[~rows])
    plate = THESIS["aluminum"]
    figures = (plate.youngs_modulus_pa, plate.poisson_ratio, plate.density_kg_m3, 0.01)
    motion = TargetMotion.of(
        plate_impedance(*(np.full(10, value) for value in figures)), raw.run[rows] == 2
    )
    expected, _ = velocity_before_contact(before[rows], PulseMoments.of(raw.force_n[rows]), motion)
    np.testing.assert_allclose(after[rows], expected, rtol=1e-5)
    assert np.all(after[rows] > before[rows])
    again = read_snapshot(store, "true")
    np.testing.assert_array_equal(again.table.x, built.table.x)
    assert again.hash == built.hash
