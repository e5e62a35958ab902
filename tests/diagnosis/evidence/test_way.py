"""Ways to stray, and how they are weighed, against W as one matrix and dense covariances."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.astray import AMPLITUDES, Strays, Ways
from pyroshock.diagnosis.evidence.courses import SAME
from pyroshock.diagnosis.evidence.way import Block, Way
from pyroshock.diagnosis.evidence.whitening import Whitening
from scipy.stats import multivariate_normal, norm
from support.records.small_scenes import small, small_scene

RNG = np.random.default_rng(12)
#: Twelve cells of four configurations by three directions, over courses of one, two and four components.
BLOCK = Block(0.4 * RNG.standard_normal((12, 4, 3)))
ROOTS = [RNG.standard_normal((4, k)) for k in (1, 2, 4)]
SLOPES = 5
NOISE = np.diag(RNG.uniform(0.5, 2.0, 12))
Z, SLOPE = 3 * RNG.standard_normal(12), RNG.standard_normal(SLOPES)


def whole(way: Way) -> np.ndarray:
    """(N + d, a k): W column by column, a direction's components side by side."""
    columns: list[np.ndarray] = []
    for a in range(way.block.whitened.shape[2]):
        for k in range(way.root.shape[1]):
            cells = sum(way.block.whitened[:, c, a] * way.root[c, k] for c in range(way.root.shape[0]))
            beside = np.zeros(SLOPES) if way.slopes is None else way.slopes[:, len(columns)]
            columns.append(np.concatenate([np.asarray(cells), beside]))
    return np.array(columns).T


def ways() -> list[Way]:
    found = []
    for root in ROOTS:
        q = 3 * root.shape[1]
        found.append(Way("gun", "smooth", "mode", BLOCK, root))
        found.append(Way("gun", "drift", "mode", BLOCK, root, 0.5 * RNG.standard_normal((SLOPES, q))))
    return found


@pytest.mark.parametrize("way", ways(), ids=lambda way: f"{way.course} {way.root.shape[1]}")
def test_products_are_those_of_the_columns(way: Way) -> None:
    columns = whole(way)
    np.testing.assert_allclose(way.whitened(SLOPES), columns, atol=1e-12)
    np.testing.assert_allclose(way.gram, columns.T @ columns, atol=1e-12)
    along = way.along(way.block.along(Z), SLOPE)
    np.testing.assert_allclose(along, columns.T @ np.concatenate([Z, SLOPE]), atol=1e-12)


def test_gap_and_slopes_are_weighed_together() -> None:
    """By the density of both with C + a^2 W W', over that of slopes where nothing drifts; sizes are 3, 6 and 12."""
    white = Whitening.of(NOISE)
    some = ways()
    strays = Strays.of(white, some, SLOPES)
    found = strays.log_densities(white.white(Z), SLOPE)
    lower = np.block([[white.lower, np.zeros((12, SLOPES))], [np.zeros((SLOPES, 12)), np.eye(SLOPES)]])
    for way, log in zip(some, found, strict=True):
        root = lower @ whole(way)
        plain = lower @ lower.T
        each = [multivariate_normal(cov=plain + a**2 * root @ root.T).logpdf([*Z, *SLOPE]) for a in (3, 6, 12)]
        expected = np.logaddexp.reduce(each) - np.log(3) - norm.logpdf(SLOPE).sum()
        assert log == pytest.approx(expected, rel=1e-9)


def test_each_way_is_turned_to_its_own_axes() -> None:
    strays = Strays.of(Whitening.of(NOISE), ways(), SLOPES)
    ends = [*strays.starts[1:], len(strays.strength)]
    for i, (start, end) in enumerate(zip(strays.starts, ends, strict=True)):
        roots = strays.roots(i)
        np.testing.assert_allclose(roots.T @ roots, np.diag(strays.strength[start:end]), atol=1e-9)
        assert np.trace(roots.T @ roots) == pytest.approx((whole(strays.ways[i]) ** 2).sum())


@pytest.mark.parametrize("least", [0.0, 0.4, 2.0])
@pytest.mark.parametrize("size", [-5.0, 0.1, 3.0])
def test_one_size_is_drawn_beyond_the_least(size: float, least: float) -> None:
    """Against the integral over sizes of a normal prior without its middle. Several sizes have no least."""
    rng = np.random.default_rng(4)
    root = rng.standard_normal(6)
    white = Whitening.of(0.98 * np.eye(6))
    z = size * root + rng.standard_normal(6)
    one = Way("gun", "rough", "law", Block(root[:, None, None]), np.ones((1, 1)), least=least)
    two = Way("gun", "rough", "law", Block(np.stack([root, root[::-1]], axis=1)[:, None]), np.ones((1, 1)), least=least)
    found = Strays.of(white, [two, one]).log_densities(z, np.zeros(0))

    total = 0.0
    beyond = np.linspace(least, 60, 100_001)
    for sizes in (beyond, -beyond[::-1]):
        likelihood = np.exp(-0.5 * ((z[:, None] - root[:, None] * sizes) ** 2).sum(axis=0)) / (2 * np.pi) ** 3
        for amplitude in (3, 6, 12):
            share = norm.pdf(sizes / amplitude) / amplitude / (2 * norm.sf(least / amplitude))
            total += float(np.trapezoid(likelihood * share, sizes)) / 3
    assert found[1] == pytest.approx(np.log(total), abs=1e-5)
    both = np.stack([root, root[::-1]], axis=1)
    covariances = [np.eye(6) + a**2 * both @ both.T for a in (3, 6, 12)]
    expected = np.mean([multivariate_normal(cov=one).pdf(z) for one in covariances])
    assert found[0] == pytest.approx(np.log(expected))


def test_amplitudes_are_those_that_are_published() -> None:
    assert AMPLITUDES == (3.0, 6.0, 12.0)  # docs/diagnosis.md


def test_same_share_of_an_effect_everywhere_is_that_effect() -> None:
    """In all configurations alike only single observables and bands stray; over other courses laws do, too."""
    strays = small_scene().strays(0)
    for stage in ("gun", "contact"):
        same = {manner for where, course, manner in strays.names if (where, course) == (stage, SAME)}
        others = {manner for where, course, manner in strays.names if (where, course) == (stage, "smooth")}
        assert not same & {"law", "direction"}
        assert others >= {"direction", "law"}
        assert same == others - {"law", "direction"}
    assert "one" in {manner for _, course, manner in strays.names if course == SAME}


def test_what_drifts_leans_repetitions_too() -> None:
    """Nothing else does; `slopes` are those that repetitions say something of."""
    scene = small_scene()
    strays = scene.strays(1)
    assert strays.slopes == len(scene.cells.creep.columns) > 0
    for i, way in enumerate(strays.ways):
        assert (way.slopes is not None) == (way.course == "drift")
        roots = strays.roots(i)
        assert roots.shape[0] == len(scene.cells.z) + strays.slopes
        assert roots[len(scene.cells.z) :].any() == (way.course == "drift")


def test_stages_stray_where_there_is_a_cell() -> None:
    scene, (_, shown, _) = small_scene(), small()
    ways = Ways.of(["gun", "plate", "contact"], scene.cells, scene.kernels, shown)
    assert [laid.stage for laid in ways.laid] == ["gun", "contact"]
    assert len(ways.over) == 2
    assert {stage for stage, _, _ in ways.before(scene.before[0]).names} == {"gun", "contact"}


def test_without_a_least_and_slopes_a_way_is_one_column_of_any_size() -> None:
    way = Way("gun", "same", "one", Block(BLOCK.whitened[:, :, :1]), ROOTS[0])
    white = Whitening.of(NOISE)
    strays = Strays.of(white, [way])
    assert strays.roots(0).shape == (12, 1)
    column = white.lower @ whole(way)[:12]
    each = [
        multivariate_normal(cov=white.lower @ white.lower.T + a**2 * column @ column.T).logpdf(Z) for a in (3, 6, 12)
    ]
    assert strays.log_densities(white.white(Z), np.zeros(0))[0] == pytest.approx(np.logaddexp.reduce(each) - np.log(3))
