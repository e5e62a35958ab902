"""Over which configurations a gap may spread: variances, levels, limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.diagnosis.evidence.courses import Course, courses
from pyroshock.diagnosis.evidence.creep import Creep
from pyroshock.diagnosis.evidence.factors import each_level, squared_distances
from pyroshock.diagnosis.evidence.whitening import Whitening

FACTORS = [{"bullet_mass": mass, "insulator": word} for mass in (0.1, 0.2, 0.5) for word in ("none", "polymeric")]


def made(loudness: list[float]) -> list[Course]:
    distance, ones = squared_distances(FACTORS), np.ones((len(FACTORS), 1))
    steady = Creep(np.zeros(0), np.zeros(0, dtype=np.intp), Whitening.of(np.zeros((0, 0))), ones, 0 * ones)
    return courses(distance, steady, FACTORS, np.array(loudness))


def test_each_course_has_variance_one_where_it_acts() -> None:
    for one in made([0.0, 1.0, 2.0, 3.0, 4.0, 5.0]):
        variance = (one.root**2).sum(axis=1)
        acting = variance > 0
        assert variance[acting].mean() == pytest.approx(1.0, abs=1e-5)
        if one.name not in ("level", "limit"):
            assert acting.all()


def test_levels_are_those_of_the_factors_each_once() -> None:
    """Three masses and two insulators; a level of one configuration alone is none."""
    inside = {tuple(one.tolist()) for one in each_level(FACTORS)}
    assert len(inside) == len(each_level(FACTORS)) == 5
    assert (True, True, False, False, False, False) in inside
    assert (True, False, True, False, True, False) in inside
    assert each_level(FACTORS[:3]) == []


@given(st.lists(st.floats(-3, 3), min_size=6, max_size=6))
def test_a_limit_touches_the_loudest_in_proportion(loudness: list[float]) -> None:
    order = np.array(loudness)
    for one in made(loudness):
        if one.name == "limit":
            ramp = one.root[:, 0]
            touched = ramp > 0
            assert touched.sum() >= 2
            assert order[touched].min() >= order[~touched].max()
            assert np.all(np.diff(ramp[np.argsort(order, kind="stable")]) >= -1e-12)


def test_without_an_answer_there_is_no_limit() -> None:
    assert not [one for one in made([np.nan] * 4 + [1.0, 2.0]) if one.name == "limit"]
    assert not [one for one in made([1.0] * 6) if one.name == "limit"]
    known = [one for one in made([np.nan, 0.0, 1.0, 2.0, 3.0, 4.0]) if one.name == "limit"]
    assert known
    assert all(one.root[0, 0] == 0 for one in known)
