"""Frames of the library at the size and of the types that an analysis counts on."""

from __future__ import annotations

import pyroshock as ps
import pytest
from pyroshock.app.library.frames import unit_of
from pyroshock.benchmarks.crowded import fill
from pyroshock.benchmarks.library import frame_figure
from pyroshock.schema.listings import iter_impacts


@pytest.fixture(scope="module")
def crowded(tmp_path_factory):
    url = f"sqlite:///{tmp_path_factory.mktemp('crowded') / 'lab.db'}"
    fill(url, 3000)
    with ps.open(url) as store:
        yield store


def test_figures_that_no_impact_has_are_numbers_all_the_same(crowded):
    frame = crowded.impacts()
    numbers = [name for name in frame.columns if frame.attrs["units"].get(name)]
    assert {"peak_acceleration_m_s2", "peak_force_n", "tip_radius_m"} <= set(numbers)
    assert all(frame[name].dtype == "float64" for name in numbers)
    assert frame["peak_acceleration_m_s2"].isna().all()


def test_many_impacts_are_those_of_the_listing(crowded):
    frame = crowded.impacts()
    with crowded.store.reading() as session:
        listed = list(iter_impacts(session))
    for name in ("id", "campaign", "tip_material", "tip_radius_m", "peak_force_n", "velocity_kind", "quality"):
        assert frame[name].tolist() == [row[name] for row in listed]


def test_the_measurement_beside_pandas_compares_the_same_rows(crowded):
    assert frame_figure(crowded, 1).value.median > 0


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
