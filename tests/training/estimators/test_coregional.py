"""Gaussian processes for many outputs: what every regression promises, and what these do."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pyroshock.training.estimators.base import Estimator
from pyroshock.training.estimators.coregional import Coregional, principal, rotate_back
from pyroshock.training.estimators.single_outputs import SingleOutputs
from support.checks.estimator_checks import CHECKS, check_learns_known_law, fitted, known_law

Floats = NDArray[np.float64]
#: Few steps: promises hold for whatever was learned.
SHORT = [Coregional(iterations=8), SingleOutputs(iterations=2, tuning_rows=60)]
FULL = [Coregional(rank=3), SingleOutputs(tuning_rows=120)]


def by_kind(estimator: Estimator) -> str:
    return estimator.kind


@pytest.mark.parametrize("check", CHECKS, ids=lambda check: check.__name__)
@pytest.mark.parametrize("estimator", SHORT, ids=by_kind)
def test_promise(estimator: Estimator, check: Callable[[Estimator], None]) -> None:
    check(estimator)


@pytest.mark.parametrize("estimator", FULL, ids=by_kind)
def test_learns_known_law(estimator: Estimator) -> None:
    check_learns_known_law(estimator, 0.025)


def fit(estimator: Estimator, x: Floats, y: Floats) -> Estimator:
    return estimator.fit(x, y, np.arange(len(x)), np.random.default_rng(0))


def waves(n: int, noise: float = 0.0) -> tuple[Floats, Floats]:
    """Two outputs of two predictors, the second twice the first and more; a third of its own."""
    rng = np.random.default_rng(13)
    x = rng.uniform(-2, 2, size=(n, 2))
    first = np.sin(1.5 * x[:, 0]) + 0.5 * x[:, 1]
    y = np.column_stack([first, 2 * first + 3, np.cos(2 * x[:, 1])])
    return x, y + noise * rng.standard_normal(y.shape) * [1, 2, 1]


@cache
def learned(kind: type[Coregional] | type[SingleOutputs], noise: float) -> Estimator:
    return fit(kind(), *waves(80, noise))


@pytest.mark.parametrize("kind", [Coregional, SingleOutputs])
class TestBoth:
    def test_interpolates_clean_data(self, kind: type[Any]) -> None:
        x, y = waves(80)
        np.testing.assert_allclose(learned(kind, 0.0).predict(x).mean, y, atol=0.01)

    def test_spread_grows_away_from_data(self, kind: type[Any]) -> None:
        near, far = learned(kind, 0.05).predict(np.array([[0.0, 0.0], [40.0, -40.0]])).spread
        assert np.all(far > 5 * near)

    def test_spread_is_the_noise_among_data(self, kind: type[Any]) -> None:
        spread = learned(kind, 0.05).predict(np.zeros((1, 2))).spread
        np.testing.assert_allclose(spread, [[0.05, 0.1, 0.05]], rtol=0.4)

    def test_band_covers_new_measurements(self, kind: type[Any]) -> None:
        x, y = waves(500, 0.05)
        found = learned(kind, 0.05).predict(x[80:])
        within = np.abs(found.mean - y[80:]) < 1.645 * found.spread
        assert 0.84 < within.mean() < 0.95

    def test_learned_anew_from_the_same_rows_it_predicts_the_same(self, kind: type[Any]) -> None:
        x, y = waves(80, 0.05)
        model = learned(kind, 0.05)
        again = model.relearn(x, y, np.arange(80), np.random.default_rng(1))
        np.testing.assert_allclose(again.predict(x).mean, model.predict(x).mean, atol=0.01)
        np.testing.assert_allclose(again.predict(x).spread, model.predict(x).spread, rtol=0.02)

    def test_learned_anew_it_interpolates_rows_that_did_not_tune_it(
        self, kind: type[Any], monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("pyroshock.training.estimators.coregional.RELEARNING_ROWS", 40)
        x, y = waves(80)
        model = fit(kind(**({"tuning_rows": 40} if kind is SingleOutputs else {})), x, y)
        again = model.relearn(x, y, np.arange(80), np.random.default_rng(1))
        np.testing.assert_allclose(again.predict(x).mean, y, atol=0.01)

    def test_refit_keeps_the_kernel(self, kind: type[Any]) -> None:
        one, (x, y) = learned(kind, 0.05), waves(120, 0.05)
        other = one.refit(x, y, np.arange(120), np.random.default_rng(1))
        for name in ("log_lengthscales", "loadings", "log_noise"):
            np.testing.assert_array_equal(other.arrays()[name], one.arrays()[name])
        assert np.all(other.predict(x[80:]).spread < one.predict(x[80:]).spread + 1e-9)

    def test_constant_output_stays_constant(
        self, kind: type[Coregional] | type[SingleOutputs]
    ) -> None:
        """Both ends of a force are zero."""
        x, y = waves(40)
        y[:, 1] = 0.25
        np.testing.assert_allclose(
            fit(kind(iterations=5), x, y).predict(x).mean[:, 1], 0.25, atol=1e-9
        )

    def test_unknown_kernel(self, kind: type[Coregional]) -> None:
        with pytest.raises(LookupError, match="periodic"):
            kind(kernel="periodic")


def test_independent_tasks_stay_independent() -> None:
    """Outputs that share nothing: B is near diagonal, and the predictions are those of single
    processes."""
    rng = np.random.default_rng(14)
    x = rng.uniform(-2, 2, size=(100, 2))
    y = np.column_stack([np.sin(2 * x[:, 0]), rng.standard_normal(100)])
    one = fit(Coregional(components=False), x, y)
    learned, asked = one.arrays(), rng.uniform(-2, 2, size=(50, 2))
    b = learned["loadings"] @ learned["loadings"].T + np.diag(np.exp(learned["log_kappa"]))
    assert abs(b[0, 1]) < 0.1 * b[0, 0]
    alone = fit(Coregional(components=False), x, y[:, :1]).predict(asked).mean
    np.testing.assert_allclose(one.predict(asked).mean[:, :1], alone, atol=0.02)


def test_outputs_inform_each_other() -> None:
    """A clean output tells of its noisy double; a process of its own cannot."""
    rng, (x, y) = np.random.default_rng(15), waves(40)
    noisy = y[:, :2] + rng.normal(size=(40, 2)) * [1e-3, 2.0]
    asked, truth = (part[40:] for part in waves(400))
    errors = [
        np.abs(fit(one, x, noisy).predict(asked).mean - truth[:, :2])[:, 1].mean() for one in ONES
    ]
    assert errors[0] < 0.5 * errors[1]


ONES = (Coregional(rank=1, components=False), SingleOutputs())


def test_scatter_of_all_outputs_together() -> None:
    # Repetitions that differ in amplitude: learned as noise of components, as a law when outputs
    # scatter alone.
    _, asked = known_law()
    coregional = fitted(Coregional(iterations=100))
    assert coregional.arrays()["log_lengthscales"].min() > np.log(0.3) + 0.5
    wrong = np.abs(coregional.predict(asked.x).mean - asked.y).mean()
    own = fitted(Coregional(iterations=100, components=False))
    assert wrong < 0.5 * np.abs(own.predict(asked.x).mean - asked.y).mean()
    # The checks' own campaign: 240 pulses, and no more steps than the default allows.
    coregional = fitted(Coregional(rank=3, iterations=60))
    assert isinstance(coregional, Coregional)
    assert coregional.maximisation_.truncation_bound < 1e-6 * 240 * 20


@pytest.mark.parametrize("constant", [0, 2, 4])
def test_components_make_the_outputs(constant: int) -> None:
    y = np.random.default_rng(3).normal(size=(30, 4)) @ np.random.default_rng(4).normal(size=(4, 4))
    y = (y - y.mean(axis=0)) * (np.arange(4) >= constant)
    turn = principal(y)
    scores = rotate_back(y, turn)
    assert len(turn) == max(4 - constant, 1)
    np.testing.assert_allclose(scores @ turn, y, atol=1e-12)
    if constant < 4:
        np.testing.assert_allclose(scores.T @ scores / 30, np.eye(len(turn)), atol=1e-12)


def test_likelihood_does_not_fall() -> None:
    # Nor has the search anything left to gain where it ends.
    one = learned(Coregional, 0.05)
    assert isinstance(one, Coregional)
    assert one.maximisation_.converged
    assert one.maximisation_.losses[-1] == one.maximisation_.losses.min()
    assert one.maximisation_.losses[-1] < one.maximisation_.losses[0] - 0.5
    report: Any = learned(Coregional, 0.05).fit_report()
    assert report.settings["kernel"] == "rbf" and report.settings["converged"] is True
    assert len(report.by_predictor["lengthscale"]) == 2
    assert report.histories["loss"][-1] < report.histories["loss"][0]
    single: Any = learned(SingleOutputs, 0.05).fit_report()
    assert 0 < single.settings["noise"] < 0.2 and len(single.histories["loss"]) > 3
    with pytest.raises(ValueError, match="rank 0"):
        Coregional(rank=0)


def test_rows_in_any_order() -> None:
    x, y = waves(60, 0.05)
    order = np.random.default_rng(2).permutation(60)
    a, b = (
        fit(Coregional(iterations=20), x[rows], y[rows]).predict(x).mean
        for rows in (np.arange(60), order)
    )
    np.testing.assert_allclose(a, b, atol=1e-4)
    x, y = waves(40, 0.05)
    wider = np.column_stack([x, np.full(40, 7.0)])
    one = fit(Coregional(iterations=10), wider, y)
    np.testing.assert_array_equal(
        one.predict(np.add(wider, [0.0, 0.0, 1.0])).mean, one.predict(wider).mean
    )


def own_kernel(linear: bool = True, scale: float = 1.0):
    """RBF plus linear, as a user writes it, with a prior on the lengthscale."""
    import gpytorch

    rbf = gpytorch.kernels.RBFKernel(
        lengthscale_prior=gpytorch.priors.LogNormalPrior(np.log(scale), 0.1)
    )
    return rbf + gpytorch.kernels.LinearKernel() if linear else rbf


@pytest.mark.parametrize("kind", [Coregional, SingleOutputs])
class TestOwnKernels:
    def test_learns_what_the_named_kernel_cannot_say(self, kind: type[Any]) -> None:
        """A line goes on beyond the data where a linear kernel was handed in."""
        rng = np.random.default_rng(4)
        x = rng.uniform(-1, 1, size=(40, 2))
        y = np.column_stack(
            [3 * x[:, 0] - x[:, 1], x[:, 0] + 2 * x[:, 1]]
        ) + 0.01 * rng.standard_normal((40, 2))
        far, truth = np.array([[6.0, -6.0]]), np.array([[24.0, -6.0]])
        own = fit(kind(kernel=own_kernel(), iterations=60), x, y).predict(far).mean
        named = fit(kind(iterations=60), x, y).predict(far).mean
        assert np.abs(own - truth).max() < 1.0 < np.abs(named - truth).max()

    def test_is_stored_as_json_and_numbers(self, kind: type[Any]) -> None:
        import json

        x, y = waves(40, 0.05)
        one = fit(kind(kernel=own_kernel(), iterations=5), x, y)
        settings = json.loads(json.dumps(one.settings()))
        again = type(one)(**settings).restore(one.arrays())
        for ours, theirs in zip(
            vars(one.predict(x)).values(), vars(again.predict(x)).values(), strict=True
        ):
            np.testing.assert_allclose(ours, theirs, rtol=1e-9)
        np.testing.assert_allclose(again.refit(x, y, np.arange(40),
        np.random.default_rng(0)).predict(x).mean,
                                   one.predict(x).mean, rtol=1e-9)  # fmt: skip
        report: Any = again.fit_report()
        assert report.settings["kernel"] == "AdditiveKernel(RBFKernel, LinearKernel)"
        assert report.settings["kernel.kernels.0.lengthscale"] > 0

    @pytest.mark.parametrize("name", ["rbf", "matern52", "rational-quadratic"])
    def test_named_kernel_may_be_handed_in_and_stored(self, kind: type[Any], name: str) -> None:
        """With GPyTorch's bounds after it is read, to the same predictions."""
        import json

        from pyroshock.training.gp.multitask import named_kernel

        x, y = waves(40, 0.05)
        one = fit(kind(kernel=named_kernel(name, 2), iterations=5), x, y)
        again = type(one)(**json.loads(json.dumps(one.settings()))).restore(one.arrays())
        np.testing.assert_allclose(again.predict(x).mean, one.predict(x).mean, rtol=1e-9)
        named = fit(kind(kernel=name, iterations=5), x, y).predict(x)
        np.testing.assert_allclose(one.predict(x).mean, named.mean, rtol=1e-5, atol=1e-6)

    def test_a_prior_that_is_handed_in_decides(self, kind: type[Any]) -> None:
        x, y = waves(40, 0.05)
        scales: list[Any] = [
            fit(kind(kernel=own_kernel(False, scale), iterations=40), x, y)
            .fit_report()
            .settings["kernel.lengthscale"]
            for scale in (0.2, 8.0)
        ]
        assert scales[0] < 1.0 < 3.0 < scales[1]

    def test_what_is_given_stays_as_it_was(self, kind: type[Any]) -> None:
        kernel = own_kernel(False)
        before = kernel.lengthscale.item()
        fit(kind(kernel=kernel, iterations=5), *waves(30))
        assert kernel.lengthscale.item() == before

    def test_another_class_is_refused(self, kind: type[Any]) -> None:
        import gpytorch

        with pytest.raises(
            ValueError, match="SpectralMixtureKernel cannot be stored; kernels that can: RBFKernel"
        ):
            kind(kernel=gpytorch.kernels.SpectralMixtureKernel(num_mixtures=2, ard_num_dims=2))
        with pytest.raises(ValueError, match=r"no kernel 'os\.system'"):
            fit(kind(kernel={"class": "os.system"}), *waves(30))


_OLD = Path(__file__).with_name("older_processes.npz")


@pytest.mark.parametrize("kind", ["coregional", "single-outputs", "contact-time"])
def test_models_of_older_software_are_read(kind: str) -> None:
    """Arrays, and what they predicted, by the software that trained without GPyTorch."""
    from pyroshock.training.models.serialization import build

    with np.load(_OLD, allow_pickle=False) as file:
        stored = {
            name.partition("/")[2]: file[name] for name in file.files if name.startswith(f"{kind}/")
        }
    x, mean, spread = (stored.pop(name) for name in ("asked", "mean", "spread"))
    settings = {"kernel": "rbf"} if kind != "contact-time" else {}
    prediction = build({"kind": kind, "settings": settings}).restore(stored).predict(x)
    np.testing.assert_allclose(prediction.mean, mean, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(prediction.spread, spread, rtol=1e-6)


def test_outputs_are_learned_anew_from_where_they_are() -> None:
    x, y = waves(80, 0.05)
    model = SingleOutputs().fit(x, y, np.arange(80), np.random.default_rng(0))
    again = model.relearn(x, y, np.arange(80), np.random.default_rng(0))
    assert model.losses_ is not None and again.losses_ is not None
    for losses, further in zip(model.losses_, again.losses_, strict=True):
        assert further[0] == pytest.approx(losses.min(), abs=1e-9)
        assert further.min() <= further[0] and 2 * len(further) < len(losses)
