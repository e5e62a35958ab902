"""Ours and its peers give the same numbers, at small sizes, and have their figures."""

from __future__ import annotations

import json

# Importing it warns; a test that imports it first would fail by that.
import gpytorch  # noqa: F401
import numpy as np
import pytest
from pyroshock.training.gp.kernels import kernel_matrix
from pyroshock.validation.baselines import BASELINES
from support.records.force_records import ForceRecord, Hit
from support.records.hammer_recordings import write_campaign

from benchmarks import by_hand, coregional, diagnosing, growth, gun, impacts, pulses, series
from benchmarks.page import draw_growth

N, ASKED = 12, 3


def test_shots_agree_and_are_timed():
    figure = gun.figure(gun.three_effects, "few", shots=200, repeats=2, limit=1.0)
    assert figure.holds and figure.over_bound.median > 0.5


def test_impacts_agree_and_are_timed():
    speed, *errors = impacts.measure_impacts(None, count=60, every=20, repeats=2)
    assert speed.over_bound.median > 0.5
    assert len(errors) == 4 and all(figure.holds for figure in errors)


@pytest.fixture(scope="module")
def content(tmp_path_factory):
    """Tips of aluminium, steel, delrin, aluminium."""
    folder = tmp_path_factory.mktemp("c") / "c"
    return series.Content.of(write_campaign(folder, 4, ".npz", np.random.default_rng(1)))


@pytest.mark.parametrize("kind", [series.OurStore, *series.PEERS])
def test_stored_series_and_pulses_come_back(kind, content, tmp_path):
    storage = kind(tmp_path / "kept", content)
    storage.empty()
    storage.store()
    for run in (1, 3):
        force = content.recordings[run - 1].series["force"]
        np.testing.assert_array_equal(storage.whole(run), force)
        np.testing.assert_array_equal(storage.window(run, 1000, 1500), force[1000:1500])
    for level, count in (("aluminum", 20), ("steel", 10)):
        expected = content.pulses(level)
        assert len(expected) == count
        for read_pulse, pulse in zip(storage.pulses(level), expected, strict=True):
            np.testing.assert_array_equal(read_pulse, pulse)
    assert storage.room() > 1e6


def test_content_for_others_is_the_same(content, tmp_path):
    folder = content.write(tmp_path / "written")
    np.testing.assert_array_equal(
        np.load(folder / "2.npz")["force"], content.recordings[1].series["force"]
    )


def test_every_question_has_a_figure_of_every_peer(tmp_path):
    figures = list(series.measure_querying(tmp_path, recordings=2, stores=1, reads=1))
    for _, question in series.QUESTIONS.values():
        assert {f.peer_name for f in figures if f.question == question} == {
            "h5py",
            "sqlite3",
            "pandas",
            "QCoDeS",
        }
    assert all(f.over_bound.median > 0 for f in figures if f.value and f.kind == "time")


def test_other_numbers_are_no_answer(content, tmp_path, monkeypatch):
    monkeypatch.setattr(series.Hdf5, "whole", lambda *_: np.zeros(3, np.float32))
    with pytest.raises(ValueError, match="other numbers"):
        series.check_answers("whole", {"h5py": series.Hdf5(tmp_path / "kept", content)}, content)


HITS = [Hit(1.0, 1e-3, False, False), Hit(2.0, 1e-3, True, False)]


@pytest.mark.parametrize(
    ("hits", "detected", "score"),
    [
        (HITS, [(1.001, 1.1e-3, False), (2.0, 0.9e-3, True)], (0, 0, pytest.approx(0.1))),
        (HITS, [(1.0, 1e-3, False), (2.5, 1e-3, True)], (2, 1, 0.0)),  # one missed, one made up
        (HITS, [(1.0, 1e-3, False), (2.0, 1e-3, True), (2.004, 1e-3, False)], (1, 0, 0.0)),
        (HITS, [], (2, 1, float("inf"))),
        (
            [Hit(1.0, 1e-3, False, True)],
            [(1.0, 2e-3, True)],
            (0, 0, float("inf")),
        ),  # chatter is not judged
    ],
)
def test_pulses_are_scored_against_the_truth(hits, detected, score):
    detected_pulses = [pulses.DetectedPulse(*peak) for peak in detected]
    result = pulses.score(ForceRecord(np.zeros(0), hits), detected_pulses)
    assert (result.miscounted, result.misjudged, result.error) == score


def test_pulses_agree_on_a_clean_record():
    """Half sines of 2 ms, the second with another of a third 20 ms later; contacts end where 0.5 %
    are left."""
    rate, force = 50_000.0, np.random.default_rng(0).normal(0, 0.01, 150_000)
    for at, height in ((50_000, 1e3), (100_000, 1e3), (101_000, 333.0)):
        force[at : at + 100] += height * np.sin(np.pi * np.arange(100) / 100)
    peers = [
        pulses.with_second_hits(force, method(force, rate), rate)
        for method in pulses.PEERS.values()
    ]
    for detected in (pulses.ours(force, rate), *peers):
        assert [round(pulse.start_s, 3) for pulse in detected] == [1.0, 2.0]
        assert [pulse.contact_time_s for pulse in detected] == pytest.approx([2e-3, 2e-3], rel=0.02)
        assert [pulse.followed for pulse in detected] == [False, True]


def dense() -> tuple[float, np.ndarray, np.ndarray]:
    """Loss, means and standard deviations of a coregional process by one factorisation of
    everything."""
    (x, y), at = coregional.pulses(N), coregional.parameters()
    a, new = x / at.lengthscales, coregional.new_pulses(ASKED) / at.lengthscales
    full = np.kron(kernel_matrix("rbf", a, a), at.b) + np.kron(np.eye(N), np.diag(at.noise))
    values = y.ravel()
    loss = 0.5 * (
        values @ np.linalg.solve(full, values)
        + np.linalg.slogdet(full)[1]
        + values.size * np.log(2 * np.pi)
    )
    across = np.kron(kernel_matrix("rbf", new, a), at.b)
    variance = np.kron(np.ones(ASKED), np.diag(at.b) + at.noise)
    variance -= np.einsum("ij,ji->i", across, np.linalg.solve(full, across.T))
    mean = across @ np.linalg.solve(full, values)
    return float(loss), mean.reshape(ASKED, -1), np.sqrt(variance).reshape(ASKED, -1)


@pytest.mark.parametrize("name", [coregional.OURS, coregional.PLAIN, coregional.GPYTORCH])
def test_likelihoods_are_the_dense_ones(name):
    answer = coregional.answering(name)({"what": "likelihood", "n": N})
    assert answer["value"] == pytest.approx(dense()[0], abs=1e-4)
    assert answer["seconds"] > 0 and answer["peak_bytes"] > 1e6


@pytest.mark.parametrize("name", [coregional.OURS, coregional.GPYTORCH])
def test_predictions_are_the_dense_ones(name):
    answer = coregional.answering(name)({"what": "prediction", "n": N, "asked": ASKED})
    np.testing.assert_allclose(answer["mean"], dense()[1], atol=1e-5)
    np.testing.assert_allclose(answer["spread"], dense()[2], atol=1e-5)


def test_another_likelihood_is_refused(tmp_path):
    kept = np.load(coregional.write_pulses(tmp_path, N, ASKED))
    np.testing.assert_array_equal(kept["loadings"], coregional.parameters().loadings)
    with pytest.raises(ValueError, match="somebody"):
        coregional.check_agreement({coregional.OURS: [1.0], "somebody": [1.1]}, 0.01)


def test_code_of_our_own_gives_the_numbers_of_libraries():
    means = [method() for method in by_hand.left_out(60).values()]
    assert len(means) == 3 and np.ptp(means[0]) > 0.1
    np.testing.assert_allclose(means, [means[0]] * 3, atol=1e-8)
    alone, model = (method() for method in by_hand.likelihoods(30).values())
    assert alone == pytest.approx(model, abs=1e-6)
    ours, theirs = (method() for method in by_hand.kernels(30).values())
    assert ours.shape == (1, 13) and np.abs(ours).max() > 1e-3
    np.testing.assert_allclose(ours, theirs, atol=1e-9)
    losses = [
        method()
        for method in by_hand.contact_time(by_hand.SETTINGS["rbf, one lengthscale"], 40).values()
    ]
    assert losses[0] == pytest.approx(losses[1], abs=1e-5)
    assert "7 factors of resolution 3: 8 runs, pyDOE3 16" in by_hand.fewest_runs()


def test_another_number_ends_the_run():
    with pytest.raises(ValueError, match="a sum: theirs gives other numbers"):
        by_hand.compare("a sum", {"ours": lambda: 1.0, "theirs": lambda: 1.1}, 1, 0.01)


@pytest.mark.slow
def test_every_simple_method_has_its_time_and_its_answer():
    figures = list(diagnosing.measure_diagnosing(None, campaigns=1, learn_from=0))
    for kind in ("time", "quality"):
        assert {f.peer_name for f in figures if f.kind == kind} == set(BASELINES)
    assert all(
        "of 1 first" in f.ours and "of 1 first" in f.peer for f in figures if f.kind == "quality"
    )


def test_drawn_cases_repeat_and_recorded_rates_are_read(tmp_path):
    case, seed, task = diagnosing.drawn("gun", 0)
    assert (case, seed) == diagnosing.drawn("gun", 0)[:2]
    assert case.kind == "gun" and len(case.strengths) == 1 and task.tier == diagnosing.TIER
    assert "right first 0." in diagnosing.recorded_rates()
    assert diagnosing.recorded_rates(tmp_path) == "the recorded checks are not here"


def power_law(power: float) -> growth.Curve:
    sizes = (10, 100, 1000)
    points = [
        growth.Point("pulses", "training a law", size, (2.0 * size**power, 3.0 * size**power))
        for size in sizes
    ]
    return growth.Curve(points, "a limit")


def test_a_figure_tells_growth_and_exponent():
    assert power_law(1.7).exponents().median == pytest.approx(1.7)
    figure = power_law(1.0).figure()
    assert figure.value.median == pytest.approx(100)
    assert figure.bound == "as n^p, p = 1 (1 to 1); a limit" and "10 to 1,000 pulses" in figure.name


def test_sizes_beyond_the_budget_are_left_out():
    costs = growth.within_budget(lambda n: (n**2 / 1e4,), (10, 100, 1000, 10_000), budget_s=150)
    assert list(costs) == [10, 100, 1000]


def test_curves_of_small_sizes_have_their_points_and_picture(tmp_path):
    store = list(growth.store_curves(tmp_path, (1_000,)))
    assert [curve.points[0].curve for curve in store] == [*growth.QUESTIONS, growth.ROOM]
    assert store[-1].points[0].values[0] > 1_000 * 100
    training, predictions = growth.training_curves(1e9, (60, 120), ("tree",))
    assert (
        [point.size for point in training.points]
        == [point.size for point in predictions.points]
        == [60, 120]
    )
    points = [vars(point) for curve in (*store, training, predictions) for point in curve.points]
    draw_growth(json.loads(json.dumps(points)), tmp_path / "growth.png")
    assert (tmp_path / "growth.png").stat().st_size > 5_000
