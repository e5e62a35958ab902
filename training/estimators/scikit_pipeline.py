"""Regressions that are scikit-learn's: a pipeline, its search over settings, its file.

A fitted scikit-learn regressor as an array of bytes, in the format of skops: read back without
pickle.

skops reads types by name and refuses those that it was not told to trust, before anything is made
of them. It trusts scikit-learn's estimators; what else a family needs, the family says
(`PipelineRegression.trusted`).
"""

from __future__ import annotations

import io
import json
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, ClassVar, Self
from zipfile import BadZipFile, ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..tuning.folds import grouped_folds
from ..tuning.trials import SettingsSearch, plain_trials
from .base import Arrays, Estimator, FitReport, Gaussian, require_fitted


class RegressorFileError(ValueError):
    """The bytes hold no regressor that may be read."""


def regressor_bytes(regressor: Any) -> NDArray[np.uint8]:
    """The bytes (k,) of a fitted regressor: the same for the same regressor, whenever and
    wherever."""
    import skops.io

    return np.frombuffer(_canonical(skops.io.dumps(regressor)), dtype=np.uint8)


def regressor_from(content: NDArray[np.uint8], trusted: Sequence[str]) -> Any:
    """The regressor of what `regressor_bytes` gave; `trusted` are names of types beyond those that
    skops trusts.

    Raises `RegressorFileError`, with the names of the types that are not trusted.
    """
    import skops.io
    from skops.io.exceptions import UntrustedTypesFoundException

    try:
        return skops.io.loads(content.tobytes(), trusted=trusted)
    except UntrustedTypesFoundException as error:
        raise RegressorFileError(
            f"refused before anything was made of it: {str(error).splitlines()[0]}"
        ) from error
    except (
        BadZipFile,
        EOFError,
        ImportError,
        LookupError,
        TypeError,
        ValueError,
        AttributeError,
    ) as error:
        raise RegressorFileError(
            f"no regressor can be read: {type(error).__name__}: {error}"
        ) from error


def _canonical(content: bytes) -> bytes:
    """Without what differs from run to run: addresses of objects, the time of writing, the gaps in
    a tree's nodes.

    Equal arrays stand once, whether or not they are one object.
    """
    names: dict[bytes, str] = {}

    def cleaned(node: Any) -> Any:
        if isinstance(node, list):
            return [cleaned(value) for value in node]
        if not isinstance(node, dict):
            return node
        if isinstance(node.get("file"), str):
            node["file"] = names.setdefault(
                _zero_gaps(source.read(node["file"])), f"{len(names)}.npy"
            )
        return {name: cleaned(value) for name, value in node.items() if name != "__id__"}

    target = io.BytesIO()
    with ZipFile(io.BytesIO(content)) as source, ZipFile(target, "w") as file:
        schema = cleaned(json.loads(source.read("schema.json")))
        for array, name in names.items():
            file.writestr(ZipInfo(name), array)
        file.writestr(ZipInfo("schema.json"), json.dumps(schema))
    return target.getvalue()


def _zero_gaps(content: bytes) -> bytes:
    """An npy file whose bytes between the fields of a record are 0, not what lay in memory."""
    array = np.load(io.BytesIO(content), allow_pickle=False)
    if array.dtype.names is None:
        return content
    records = np.zeros(array.shape, array.dtype)
    for name in array.dtype.names:
        records[name] = array[name]
    file = io.BytesIO()
    np.save(file, records, allow_pickle=False)
    return file.getvalue()


#: Arrays of every regressor; a family's spread may need more.
_REGRESSOR, _VERSION = "regressor", "scikit_learn"


class PipelineRegression(Estimator):
    """A regressor of scikit-learn. A family is a dataclass of settings with `kind` and `pipeline`.

    Settings that are parameters of the pipeline stand in `parameters`. Those that are None are
    searched over `grid` by the squared error of left-out configurations (`GridSearchCV` on grouped
    folds).
    """

    #: Setting -> parameter of the pipeline.
    parameters: ClassVar[Mapping[str, str]] = {}
    #: Setting -> values that are tried.
    grid: ClassVar[Mapping[str, Sequence[Any]]] = {}
    folds: ClassVar[int] = 3
    #: Types in the regressor's file that skops does not trust by itself.
    trusted: ClassVar[tuple[str, ...]] = ()
    #: Settings of `grid` whose values are spaced by their logarithm.
    logarithmic: ClassVar[tuple[str, ...]] = ()
    #: How many outputs choose for all: neighbours on a pulse are too alike to be asked each.
    search_outputs: ClassVar[int] = 4

    regressor_: Any = None
    #: What the spread needs beside the regressor.
    spread_: Arrays
    search_: SettingsSearch | None = None

    @abstractmethod
    def pipeline(self, seed: int) -> Any:
        """The unfitted regressor, of 2-D outputs; what chance there is in it comes of the seed."""

    def settings(self) -> dict[str, Any]:
        return {field.name: getattr(self, field.name) for field in fields(self)}  # type: ignore[arg-type]

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:
        regressor = self._new_regressor(int(rng.integers(2**31)))
        if any(getattr(self, name) is None for name in self.grid):
            regressor = self._search(regressor, x, y, grouped_folds(groups, self.folds, rng))
        return self._learn(regressor, x, y)

    def refit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        from sklearn import clone

        return type(self)(**self.settings())._learn(clone(self._regressor()), x, y)

    def predict(self, x: Floats) -> Gaussian:
        regressor = self._regressor()
        rows = np.asarray(x, dtype=np.float64)
        predictors = int(regressor.n_features_in_)
        if rows.ndim != 2 or rows.shape[1] != predictors:
            raise ValueError(
                f"{self.kind!r} learned from {predictors} predictors; asked "
                f"with the shape {rows.shape}"
            )
        if not len(rows):  # scikit-learn takes one row at least
            return self.predict(np.zeros((1, predictors))).take(slice(0))
        mean = np.asarray(regressor.predict(rows), dtype=np.float64).reshape(len(rows), -1)
        return Gaussian(mean, self._spread(rows, mean))

    def fit_report(self) -> FitReport:
        values = self._regressor().get_params()
        settings = self.settings() | {
            name: values[parameter] for name, parameter in self.parameters.items()
        }
        if self.search_ is None:
            return FitReport(settings=settings)
        errors = [trial.score for trial in self.search_.trials]
        return FitReport(
            settings=settings, histories={"search_error": errors}, searches={"": self.search_}
        )

    def arrays(self) -> Arrays:
        import sklearn

        return {
            _REGRESSOR: regressor_bytes(self._regressor()),
            _VERSION: np.array(sklearn.__version__),
            **self.spread_,
        }

    def restore(self, arrays: Arrays) -> Self:
        if _REGRESSOR not in arrays or _VERSION not in arrays:
            raise ValueError(
                f"{self.kind!r} is restored from {_REGRESSOR!r} and {_VERSION!r}, not from "
                f"{', '.join(sorted(arrays))}: the model was trained by older software, train it "
                "again (pyroshock train … --retrain)"
            )
        self._refuse_other_version(str(arrays[_VERSION]))
        try:
            regressor = regressor_from(arrays[_REGRESSOR], self.trusted)
        except RegressorFileError as error:
            raise RegressorFileError(f"{self.kind!r}: {error}") from error
        spread = {
            name: array for name, array in arrays.items() if name not in (_REGRESSOR, _VERSION)
        }
        self._check(regressor, spread)
        self.regressor_, self.spread_ = regressor, spread
        return self

    def _candidates(self, regressor: Any) -> Mapping[str, Sequence[Any]]:  # noqa: ARG002
        """`grid`; a family may narrow it to what the regressor is limited to."""
        return self.grid

    def _limit(self, regressor: Any, x: Floats) -> Any:  # noqa: ARG002
        """The unfitted regressor with what the rows x (n x d) allow."""
        return regressor

    def _spread_arrays(self, x: Floats, y: Floats) -> Arrays:  # noqa: ARG002
        """Of the fitted regressor and the rows x (n x d), y (n x m) that it learned from."""
        return {}

    def _spread(self, x: Floats, mean: Floats) -> Floats | None:  # noqa: ARG002
        """Standard deviations (n x m) of new measurements at x (n x d), or None."""
        return None

    def _check(self, regressor: Any, spread: Arrays) -> None:
        """Raises `ValueError` for a regressor or arrays that this family did not write."""
        expected, actual = _parts(self._new_regressor(0)), _parts(regressor)
        if actual != expected or not hasattr(regressor, "n_features_in_"):
            raise ValueError(f"{self.kind!r} is a fitted {expected}; the file holds {actual}")
        if spread:
            raise ValueError(f"{self.kind!r} has no arrays {', '.join(sorted(spread))}")

    def _refuse_other_version(self, version: str) -> None:
        """Another minor release: scikit-learn does not say that its objects mean the same there."""
        import sklearn

        if version.split(".")[:2] != sklearn.__version__.split(".")[:2]:
            raise ValueError(
                f"{self.kind!r} was trained with scikit-learn {version}, "
                f"installed is {sklearn.__version__}: install "
                f"scikit-learn=={version}, or train it again (pyroshock train … --retrain)"
            )

    def _new_regressor(self, seed: int) -> Any:
        given = {parameter: getattr(self, name) for name, parameter in self.parameters.items()}
        return self.pipeline(seed).set_params(
            **{name: value for name, value in given.items() if value is not None}
        )

    def _search(
        self, regressor: Any, x: Floats, y: Floats, folds: Sequence[NDArray[np.bool_]]
    ) -> Any:
        """The regressor with the settings that were left open, as they predict left-out
        configurations best."""
        from sklearn.model_selection import GridSearchCV
        from sklearn.preprocessing import StandardScaler

        for fold in folds:
            regressor = self._limit(regressor, x[~fold])
        values = self._candidates(regressor)
        candidates = {
            self.parameters[name]: list(values[name])
            for name in self.grid
            if getattr(self, name) is None
        }
        outputs = np.unique(
            np.linspace(0, y.shape[1] - 1, self.search_outputs + 2).astype(int)[1:-1]
        )
        splits = [(np.flatnonzero(~fold), np.flatnonzero(fold)) for fold in folds]
        search = GridSearchCV(
            regressor, candidates, scoring="neg_mean_squared_error", cv=splits, refit=False
        )
        search.fit(x, StandardScaler().fit_transform(y[:, outputs]))
        results, named = (
            search.cv_results_,
            {parameter: name for name, parameter in self.parameters.items()},
        )
        tried = [
            {named[parameter]: value for parameter, value in values.items()}
            for values in results["params"]
        ]
        seconds = len(splits) * (results["mean_fit_time"] + results["mean_score_time"])
        trials = plain_trials(tried, (-results["mean_test_score"]).tolist(), seconds.tolist())
        score = "mean squared error of left-out configurations, standardised"
        self.search_ = SettingsSearch("grid search", score, trials, self.logarithmic)
        return regressor.set_params(**search.best_params_)

    def _learn(self, regressor: Any, x: Floats, y: Floats) -> Self:
        self.regressor_ = self._limit(regressor, x).fit(x, y)
        self.spread_ = self._spread_arrays(x, y)
        return self

    def _regressor(self) -> Any:
        return require_fitted(self.regressor_, self.kind)


def scaling_pipeline(*steps: Any) -> Any:
    """A pipeline whose predictors are standardised before its other steps.

    A column that never varied is left out: nothing was learned about it, so nothing that is asked
    of it later may count. The levels of a category stay numbers: a column for each of them made no
    regression better.
    """
    from sklearn.feature_selection import VarianceThreshold
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler

    return make_pipeline(VarianceThreshold(), StandardScaler(), *steps)


def scale_outputs(regressor: Any) -> Any:
    """The regressor, learning standardised outputs."""
    from sklearn.compose import TransformedTargetRegressor
    from sklearn.preprocessing import StandardScaler

    return TransformedTargetRegressor(regressor, transformer=StandardScaler())


def regressor_per_output(regressor: Any) -> Any:
    """A regressor of one output as one of many: for each output one of its own, learning it
    standardised."""
    from sklearn.multioutput import MultiOutputRegressor

    return MultiOutputRegressor(scale_outputs(regressor))


def _parts(regressor: Any) -> dict[str, str]:
    """Class names of a regressor and of all its parts, by parameter."""
    parts = (
        {"": regressor, **regressor.get_params()}
        if hasattr(regressor, "get_params")
        else {"": regressor}
    )
    return {
        name: type(part).__name__
        for name, part in parts.items()
        if not name or hasattr(part, "get_params")
    }
