"""A campaign of a store as a record: which of several values is taken, and what is said of it."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.diagnosis.reading import read_campaign
from pyroshock.diagnosis.reading.campaign import evenly_chosen, note_columns
from pyroshock.diagnosis.reading.series import QualityExclusions, StoredImpact, clear_times
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Impact, Shot
from pyroshock.schema.session import Store
from sqlalchemy import select, update
from support.records.campaigns import gun_campaign, hammer_campaign
from support.records.plate_folders import plate_campaign
from support.stores.stores import opened


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with opened(f"sqlite:///{tmp_path}/lab.db", create=True) as store:
        yield store


def test_the_recorded_pressure_goes_before_the_set_one(store: Store, tmp_path: Path) -> None:
    ingest_folder(store, gun_campaign(tmp_path / "c", shots=4))
    with store.writing() as session:
        session.execute(
            update(Shot)
            .where(Shot.run > 1)
            .values(recorded_pressure_pa=Shot.tank_pressure_pa * 0.98)
        )
    with store.reading() as session:
        record = read_campaign(session, "gun")
        set_ones = session.scalars(select(Shot.tank_pressure_pa).order_by(Shot.run)).all()
    ratios = [
        run.tank_pressure_pa / pressure for run, pressure in zip(record.runs, set_ones, strict=True)
    ]
    # What was not recorded is what the transducer would have read.
    assert ratios == pytest.approx([0.98, 0.98, 0.98, 0.98])
    assert (
        "tank pressure: as recorded in 3 of 4 shots, in the median -2.0% from the set one; gauge"
        in record.assumptions
    )


def test_an_integrated_velocity_is_said_to_be_biased_with_its_uncertainty(
    store: Store, tmp_path: Path
) -> None:
    ingest_folder(store, hammer_campaign(tmp_path / "c"))
    values = {
        "impact_velocity_m_s": 1.5,
        "impact_velocity_u_m_s": 0.03,
        "velocity_source": "integrated",
    }
    with store.writing() as session:
        session.execute(update(Impact).values(**values))
    with store.reading() as session:
        record = read_campaign(session, "hammer")
    assert {(run.velocity_m_s, run.velocity_u_m_s) for run in record.runs} == {(1.5, 0.03)}
    assert any(
        "integrated" in text and "2.0%" in text and "yielding plate" in text
        for text in record.assumptions
    )


def test_a_velocity_at_the_plate_stands_in_for_one_at_the_muzzle(
    store: Store, tmp_path: Path
) -> None:
    ingest_folder(store, gun_campaign(tmp_path / "c", shots=4))
    with store.writing() as session:
        shots = session.scalars(select(Shot).order_by(Shot.run)).all()
        for shot, source in zip(shots, ("reported", "integrated", "reported"), strict=False):
            keys = {"campaign_id": shot.campaign_id, "configuration_id": shot.configuration_id}
            impact = Impact(
                **keys, run=shot.run, repetition=1, impact_velocity_m_s=9.0, velocity_source=source
            )
            session.add(impact)
            session.flush()
            shot.impact_id = impact.id
        for shot in shots[:2]:
            shot.measured_velocity_m_s = shot.measured_velocity_u_m_s = shot.velocity_source = None
        measured = [shot.measured_velocity_m_s for shot in shots[2:]]
    with store.reading() as session:
        record = read_campaign(session, "gun")
    assert [run.velocity_m_s for run in record.runs] == [9.0, 9.0, *measured]
    assert any(
        "muzzle velocity of 1 of 4 shots: that at the plate" in text for text in record.assumptions
    )
    assert any("impact velocity of 1 of 4 hits: integrated" in text for text in record.assumptions)


def test_series_are_of_some_runs_and_velocities_of_all(store: Store, tmp_path: Path) -> None:
    ingest_folder(store, hammer_campaign(tmp_path / "c", recordings=2, hits=5))
    with store.writing() as session:
        session.execute(update(Impact).values(impact_velocity_m_s=1.0, velocity_source="reported"))
    with store.reading() as session:
        record = read_campaign(session, "hammer", most_runs_per_configuration=3)
    assert [run.force is not None for run in record.runs] == [True, False, True, False, True] * 2
    assert all(run.velocity_m_s == 1.0 for run in record.runs)
    assert any("series of 6 of 10 hits" in text for text in record.assumptions)


def test_a_stored_campaign_is_read_as_its_folder(store: Store, tmp_path: Path) -> None:
    from pyroshock.diagnosis.reading import read_folder

    folder = plate_campaign(tmp_path / "c").folder
    ingest_folder(store, folder)
    with store.reading() as session:
        stored = read_campaign(session, "plate")
    from_folder = read_folder(folder)
    assert stored.configurations == from_folder.configurations
    assert stored.assumptions == from_folder.assumptions
    with store.reading() as session, pytest.raises(LookupError, match="known: plate"):
        read_campaign(session, "rifle")


@given(st.lists(st.one_of(st.none(), st.integers(0, 4)), max_size=60), st.integers(1, 12))
def test_so_many_of_each_group_are_chosen_first_and_last_among_them(
    groups: list[int | None], most: int
) -> None:
    chosen = evenly_chosen(groups, most)
    assert chosen == sorted(set(chosen))
    for group in {member for member in groups if member is not None}:
        members = [i for i, member in enumerate(groups) if member == group]
        members_chosen = [i for i in chosen if groups[i] == group]
        assert len(members_chosen) == min(most, len(members))
        assert members_chosen[0] == members[0]
        assert most == 1 or members_chosen[-1] == members[-1]
    assert all(groups[i] is not None for i in chosen)


def test_a_window_ends_where_the_recording_s_next_contact_begins() -> None:
    def hit(start_s: float | None, recording: int) -> StoredImpact:
        return StoredImpact(1, 1, 1, recording, 1, None, None, None, start_s, 1e-3)

    clear_s = clear_times([hit(0.5, 1), hit(0.2, 1), hit(0.3, 2), hit(None, 1)])
    assert clear_s == {1: pytest.approx(0.3 - 1e-3), 0: float("inf"), 2: float("inf")}


@pytest.mark.parametrize(
    ("lowest", "highest", "cut"), [(-99.0, 99.0, False), (-100.0, 5.0, True), (-5.0, 120.0, True)]
)
def test_a_hit_is_cut_where_its_own_samples_stand_at_a_rail(
    lowest: float, highest: float, cut: bool
) -> None:
    exclusions = QualityExclusions({}, frozenset(), {(7, "acceleration_1"): (-100.0, 120.0)})
    hit = StoredImpact(1, 1, 1, 7, 1, None, None, None, 0.1, 1e-3)
    assert exclusions.cut_top(hit, "acceleration_1", np.array([0.0, lowest, highest])) is cut
    assert not exclusions.cut_top(hit, "acceleration_2", np.array([0.0, lowest, highest]))


@pytest.mark.parametrize(
    ("name", "values", "is_note"),
    [
        ("remark", [f"shot {i}" for i in range(8)], True),
        ("temperature_c", [20 + 0.1 * i for i in range(8)], True),
        ("angle_deg", [float(i) for i in range(8)], False),
        ("pulse_setting", ["short", "long"] * 4, False),
        ("temperature_c", [20.0, 40.0] * 4, False),
        ("remark", ["a", "b", "c"], False),
        ("impact_position", [f"#{i}" for i in range(8)], False),
    ],
)
def test_notes_are_told_from_settings(name: str, values: list[str | float], is_note: bool) -> None:
    assert note_columns([{name: value} for value in values]) == ((name,) if is_note else ())
