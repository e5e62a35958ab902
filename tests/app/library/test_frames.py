"""Frames of the library at the size and of the types that an analysis counts on."""

from __future__ import annotations

import pyroshock as ps
import pytest
from pyroshock.app.common.frames import unit_of
from pyroshock.benchmarks.library import frame_figure
from pyroshock.schema.listings import iter_impacts
from support.stores.large_store import fill


@pytest.fixture(scope="module")
def large_store(tmp_path_factory):
    url = f"sqlite:///{tmp_path_factory.mktemp('large') / 'lab.db'}"
    fill(url, 3000)
    with ps.open(url) as store:
        yield store


def test_many_impacts_are_those_of_the_listing_and_absent_figures_are_numbers(large_store):
    frame = large_store.impacts()
    numbers = [name for name in frame.columns if frame.attrs["units"].get(name)]
    assert {"peak_acceleration_m_s2", "peak_force_n", "tip_radius_m"} <= set(numbers)
    assert all(frame[name].dtype == "float64" for name in numbers)
    assert frame["peak_acceleration_m_s2"].isna().all()
    frame = large_store.impacts()
    with large_store.store.reading() as session:
        listed = list(iter_impacts(session))
    for name in ("id", "campaign", "tip_material", "tip_radius_m", "peak_force_n", "velocity_kind", "quality"):
        assert frame[name].tolist() == [row[name] for row in listed]


def test_what_is_not_there_has_its_columns(large_store):
    frame = large_store.impacts(where="peak_force_n > 1e12", columns=["id", "tip_material"], sort="tip_radius_m")
    assert frame.empty and list(frame.columns) == ["id", "tip_material"]
    with pytest.raises(ps.NotFoundError, match="no column 'tip_colour'"):
        large_store.impacts(columns=["tip_colour"])
    frame = large_store.shots(columns=["tank_pressure_pa", "predicted_velocity_m_s"])
    assert frame.empty and frame.attrs["units"]["tank_pressure_pa"] == "Pa"


@pytest.mark.parametrize("listing", ["impacts", "shots"])
def test_a_limit_counts_at_least_one_row(large_store, listing):
    with pytest.raises(ps.InvalidValueError, match="limit is 0; expected 1 or more"):
        getattr(large_store, listing)(limit=0, sort="run")


def test_the_measurement_beside_pandas_compares_the_same_rows(large_store):
    assert frame_figure(large_store, 1).value.median > 0


@pytest.mark.parametrize(
    ("column", "unit"),
    [
        ("peak_force_n", "N"),
        ("impulse_n_s", "N s"),
        ("velocity_change_m_s", "m/s"),
        ("peak_acceleration_m_s2", "m/s2"),
        ("contact_time_s", "s"),
        ("force_n_lower", "N"),
        ("run", ""),
        ("n", ""),
        ("quality", ""),
    ],
)
def test_a_column_says_its_unit(column, unit):
    assert unit_of(column) == unit
