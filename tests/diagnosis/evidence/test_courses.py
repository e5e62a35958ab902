"""Over which configurations a gap may spread: variances, levels, limits."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.diagnosis.evidence.courses import Course, courses
from pyroshock.diagnosis.evidence.creep import Creep
from pyroshock.diagnosis.evidence.factors import each_level, smooth, squared_distances
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


def by_name(name: str, loudness: list[float]) -> list[np.ndarray]:
    return [one.root for one in made(loudness) if one.name == name]


@pytest.mark.parametrize(("name", "length"), [("smooth", 0.8), ("rough", 0.3)])
def test_what_goes_with_the_factors_has_their_kernel(name: str, length: float) -> None:
    (root,) = by_name(name, [0.0] * 6)
    np.testing.assert_allclose(root @ root.T, smooth(squared_distances(FACTORS), length) + 1e-6 * np.eye(6), atol=1e-9)


def test_from_configuration_to_configuration_nothing_is_shared() -> None:
    (root,) = by_name("each", [0.0] * 6)
    np.testing.assert_allclose(root @ root.T, (1 + 1e-6) * np.eye(6), atol=1e-9)


def test_limits_begin_at_their_shares_and_grow_in_proportion() -> None:
    """Quantiles of 0 to 5 at 25, 50, 70 and 85 %; beyond the last lies one configuration alone."""
    found = by_name("limit", [0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    ramps = [np.maximum(np.arange(6.0) - start, 0) for start in (1.25, 2.5, 3.5)]
    expected = [ramp / np.sqrt((ramp[ramp > 0] ** 2).mean()) for ramp in ramps]
    np.testing.assert_allclose(np.hstack(found).T, expected, atol=1e-12)


def test_three_answers_make_a_limit_and_two_none() -> None:
    (ramp,) = by_name("limit", [0.0, np.nan, 1.0, np.nan, 2.0, np.nan])
    np.testing.assert_allclose(ramp[:, 0], np.array([0, 0, 0.5, 0, 1.5, 0]) / np.sqrt((0.25 + 2.25) / 2))
    assert by_name("limit", [0.0, np.nan, 1.0, np.nan, np.nan, np.nan]) == []
    assert by_name("limit", [np.nan] * 6) == []
