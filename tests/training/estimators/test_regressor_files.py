"""Fitted regressors as bytes: the same again, nothing of a strange file runs, older ones say so."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sklearn
import skops.io
from pyroshock.training.estimators.linear import KernelRidge, LinearPowers, PartialLeastSquares
from pyroshock.training.estimators.scikit_pipeline import (
    PipelineRegression,
    RegressorFileError,
    regressor_bytes,
    regressor_from,
)
from pyroshock.training.estimators.support_vectors import SupportVectorKernel, SupportVectors
from pyroshock.training.estimators.trees import DecisionTree, TreeEnsemble
from sklearn.linear_model import LinearRegression
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.tree import DecisionTreeRegressor
from support.checks.estimator_checks import fitted

FAMILIES: list[PipelineRegression] = [
    LinearPowers(),
    PartialLeastSquares(3),
    DecisionTree(10),
    TreeEnsemble(3),
    SupportVectors(0.05, 1.0),
    SupportVectorKernel(32, 0.1, 1.0),
    KernelRidge(0.05, 0.01),
]
X = np.random.default_rng(0).standard_normal((50, 3))


def touch_trap(columns: np.ndarray) -> np.ndarray:
    Path("trap").touch()
    return columns


class Payload(LinearRegression):  # type: ignore[misc]  # scikit-learn publishes no types
    def __setstate__(self, state: dict[str, Any]) -> None:
        Path("trap").touch()
        self.__dict__.update(state)


@pytest.mark.parametrize("family", FAMILIES, ids=lambda one: one.kind)
def test_file_is_the_same_trusted_types_and_settings_again(family: PipelineRegression) -> None:
    # One that the family does not write would be trusted for nothing.
    content = fitted(family).arrays()["regressor"].tobytes()
    assert skops.io.get_untrusted_types(data=content) == sorted(family.trusted)
    first, second = (fitted(family).arrays()["regressor"] for _ in range(2))
    np.testing.assert_array_equal(first, second)
    report = fitted(family).fit_report()
    assert report.settings == family.settings()
    assert report.histories == {}


@pytest.mark.parametrize(
    ("regressor", "name"),
    [
        (Payload().fit(X, X), "test_regressor_files.Payload"),
        (
            make_pipeline(FunctionTransformer(touch_trap), LinearRegression()),
            "test_regressor_files.touch_trap",
        ),
        (
            DecisionTreeRegressor().fit(X, X),
            "sklearn.tree._tree.Tree",
        ),  # nobody would look at its nodes
    ],
    ids=["class", "function", "tree"],
)
def test_untrusted_type_is_refused_by_name_and_does_not_run(
    regressor: Any, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = regressor_bytes(regressor)
    monkeypatch.chdir(tmp_path)
    arrays = {**fitted(KernelRidge(0.05, 0.01)).arrays(), "regressor": content}
    with pytest.raises(RegressorFileError, match=name):
        KernelRidge(0.05, 0.01).restore(arrays)
    assert not (tmp_path / "trap").exists()


@pytest.mark.parametrize("name", ["os.system", "builtins.eval", "subprocess.Popen"])
def test_function_put_into_a_file_is_refused(name: str) -> None:
    """As somebody would who knows the format: the function of powers, replaced in a linear model's
    file."""
    module, _, function = name.rpartition(".")
    source = zipfile.ZipFile(io.BytesIO(fitted(LinearPowers()).arrays()["regressor"].tobytes()))
    schema = source.read("schema.json").decode()
    assert "powers_of" in schema
    edited = schema.replace("pyroshock.training.estimators.linear", module).replace(
        "powers_of", function
    )
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as file:
        for entry in source.namelist():
            file.writestr(entry, edited if entry == "schema.json" else source.read(entry))
    with pytest.raises(RegressorFileError, match=name):
        regressor_from(np.frombuffer(target.getvalue(), dtype=np.uint8), LinearPowers.trusted)


@pytest.mark.parametrize(
    "damage",
    [
        lambda c: c[: len(c) // 2],
        lambda c: c[:0],
        lambda c: np.zeros(100, np.uint8),
        lambda c: c.astype(float),
    ],
)
def test_broken_bytes_are_refused(damage: Callable[[np.ndarray], np.ndarray]) -> None:
    arrays = fitted(KernelRidge(0.05, 0.01)).arrays()
    with pytest.raises(RegressorFileError, match="'kernel-ridge': no regressor can be read"):
        KernelRidge().restore({**arrays, "regressor": damage(arrays["regressor"])})


@pytest.mark.parametrize(
    "regressor",
    [LinearRegression(), LinearRegression().fit(X, X), {"a": 1}, KernelRidge().pipeline(0)],
)
def test_regressor_of_another_family_is_refused(regressor: Any) -> None:
    arrays = fitted(KernelRidge(0.05, 0.01)).arrays()
    with pytest.raises(ValueError, match="'kernel-ridge' is a fitted"):
        KernelRidge().restore({**arrays, "regressor": regressor_bytes(regressor)})


def test_regressor_of_another_release_is_refused() -> None:
    older = {"x_mean": np.zeros(3), "centres": np.zeros((5, 3)), "tuned": np.zeros(2)}
    with pytest.raises(
        ValueError, match=r"'kernel-ridge' .* 'regressor'.* trained by older software.* --retrain"
    ):
        KernelRidge().restore(older)
    arrays = fitted(KernelRidge(0.05, 0.01)).arrays()
    with pytest.raises(
        ValueError, match=f"scikit-learn 1.2.0, installed is {sklearn.__version__}.*--retrain"
    ):
        KernelRidge().restore({**arrays, "scikit_learn": np.array("1.2.0")})
    major, minor = sklearn.__version__.split(".")[:2]
    KernelRidge().restore({**arrays, "scikit_learn": np.array(f"{major}.{minor}.99")})
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as file:
        file.writestr("schema.json", json.dumps({"protocol": 2}))
    with pytest.raises(RegressorFileError, match="no regressor can be read"):
        regressor_from(np.frombuffer(target.getvalue(), dtype=np.uint8), LinearPowers.trusted)
