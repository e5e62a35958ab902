"""Ways of keeping series and pulses give back what was stored, and are held against each other."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import querying
from benchmarks.querying_ours import Ours
from benchmarks.querying_ways import Hdf5, Parquet, PlainSqlite
from benchmarks.recordings import write_campaign
from benchmarks.stored_content import FACTOR, content_of, written

RECORDINGS = 4  # tips of aluminium, steel, delrin, aluminium


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    return content_of(write_campaign(tmp_path_factory.mktemp("c") / "c", RECORDINGS, ".npz", np.random.default_rng(1)))


@pytest.mark.parametrize("kind", [Ours, Hdf5, PlainSqlite, Parquet])
def test_what_is_stored_comes_back(kind, content, tmp_path):
    way = kind(tmp_path / "kept")
    way.empty()
    way.store(content)
    for run in (1, 3):
        force = content.recorded[run - 1].series["force"]
        np.testing.assert_array_equal(way.whole(run), force)
        np.testing.assert_array_equal(way.window(run, 1000, 1500), force[1000:1500])
    for level in ("aluminum", "steel"):
        expected = content.pulses(level)
        assert len(expected) == {"aluminum": 20, "steel": 10}[level]
        for found, pulse in zip(way.pulses(level), expected, strict=True):
            np.testing.assert_array_equal(found, pulse)
    assert way.room() > 1e6


def test_the_content_is_the_campaign(content):
    assert [one.factors[FACTOR] for one in content.recorded] == ["aluminum", "steel", "delrin", "aluminum"]
    assert all(len(one.impacts) == len(one.pulses) == 10 for one in content.recorded)


def test_content_for_others_is_the_same(content, tmp_path):
    folder = written(content, tmp_path / "written")
    np.testing.assert_array_equal(np.load(folder / "2.npz")["force"], content.recorded[1].series["force"])


def test_every_question_has_a_figure_of_every_peer(tmp_path):
    figures = list(querying.measure_querying(tmp_path, recordings=2, stores=1, reads=1))
    for question in querying.QUESTIONS.values():
        assert {f.rival for f in figures if f.question == question} == {"h5py", "sqlite3", "pandas", "QCoDeS"}
    measured = [f for f in figures if f.value and f.of == "time"]
    assert measured and all(f.near and f.near.median > 0 for f in measured)


def test_other_numbers_are_no_answer(content, tmp_path, monkeypatch):
    monkeypatch.setattr(Hdf5, "whole", lambda *_: np.zeros(3, np.float32))
    way = Hdf5(tmp_path / "kept")
    way.store(content)
    asked = {way.name: querying._here(way, content)}
    with pytest.raises(ValueError, match="other numbers"):
        querying._same(querying.WHOLE, asked, content)
