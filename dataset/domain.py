"""Where a model may be asked: the values, and the combinations of values, that it was trained on.

Leverage: how far a combination of predictors lies from all that were recorded, though each value
may lie inside.

Predictors of one campaign are collinear (three tips have five properties), so the covariance is
singular: leverage is taken in the subspace that the training rows span, and what lies off it is
judged by its distance.

Glossary: z (n x p) are numbers in standard deviations and categories as one column per level,
centred and scaled; h = |z V / S|^2 is the leverage of a row (z = U S V^T for the training rows), e
= z - z V V^T what lies off the subspace.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from ..array_types import Floats
from .table import Inputs, Integers, Predictor
from .validity_limits import Limit, OutOfRange, positions, unmet

#: Singular values below this share of the largest are round-off.
_RANK_SHARE = 1e-6
#: Distance off the subspace, in standard deviations, that is still a matter of digits.
OFF_LIMIT = 0.05


@dataclass(frozen=True, eq=False)
class Distances:
    """Of n rows: leverage and distance off the subspace as multiples of what is allowed, and each
    column's share (n x p) of the larger one."""

    leverage: Floats
    off: Floats
    shares: Floats


@dataclass(frozen=True, eq=False)
class Subspace:
    """Where the training rows lie: `mean` and `scale` (p,), `axes` (r x p) whose rows are V^T / S,
    their largest leverage and their largest distance off the subspace."""

    mean: Floats
    scale: Floats
    axes: Floats
    spread: Floats
    leverage_limit: float
    off_limit: float

    @classmethod
    def of(cls, encoded: Floats) -> Self:
        """The subspace of training rows.

        Parameters:
            encoded: The rows (n, p), a number as it is and a category as one column per level.
        """
        mean, scale = encoded.mean(axis=0), encoded.std(axis=0)
        scale = np.where(scale > 1e-12 * np.abs(encoded).max(axis=0, initial=0.0), scale, 1.0)
        _, spread, axes = np.linalg.svd((encoded - mean) / scale, full_matrices=False)
        kept = spread > _RANK_SHARE * spread.max(initial=0.0)
        subspace = cls(mean, scale, axes[kept], spread[kept], 1.0, 1.0)
        distances = subspace.distances(encoded)
        # A little above the largest, for other machines round otherwise.
        leverage = float(distances.leverage.max(initial=0.0)) * (1 + 1e-6) or 1.0
        off = max(OFF_LIMIT, 2 * float(distances.off.max(initial=0.0)))
        return cls(mean, scale, axes[kept], spread[kept], leverage, off)

    def distances(self, encoded: Floats) -> Distances:
        """How far rows lie from the training rows; above 1 is outside.

        Parameters:
            encoded: The rows (n, p), a number as it is and a category as one column per level.
        """
        z = (encoded - self.mean) / self.scale
        scores = z @ self.axes.T
        off = z - scores @ self.axes
        weighted = scores / self.spread
        leverage = (weighted**2).sum(axis=1) / self.leverage_limit
        distance = np.sqrt((off**2).sum(axis=1)) / self.off_limit
        # h = z (P z) and |e|^2 = e e, column by column.
        by_leverage = z * ((weighted / self.spread) @ self.axes)
        shares = np.where((distance > 1)[:, None], off**2, by_leverage)
        return Distances(leverage, distance, shares)

    def as_json(self) -> dict[str, Any]:
        """What `from_json` reads back."""
        arrays = {
            name: getattr(self, name).tolist() for name in ("mean", "scale", "axes", "spread")
        }
        return {**arrays, "leverage_limit": self.leverage_limit, "off_limit": self.off_limit}

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        """A subspace that was written down.

        Parameters:
            data: What `as_json` gave.

        Raises:
            KeyError: Where a part is missing.
            TypeError: For other data.
            ValueError: For parts that do not fit each other.
        """
        mean, scale, spread = (
            np.array(data[name], dtype=np.float64) for name in ("mean", "scale", "spread")
        )
        axes = np.array(data["axes"], dtype=np.float64).reshape(spread.size, mean.size)
        return cls(
            mean, scale, axes, spread, float(data["leverage_limit"]), float(data["off_limit"])
        )


_FORMAT = 1
#: Quantities of the bench that are inputs, if no predictors: name -> (attribute of `Inputs`, unit).
_BENCH = {
    "impactor_mass": ("impactor_mass_kg", "kg"),
    "plate_thickness": ("plate_thickness_m", "m"),
}

_Found = list[list[OutOfRange]]


@dataclass(frozen=True, eq=False)
class Domain:
    """The validity domain of what is trained on a table. `bench` limits what no predictor tells;
    `met` (k x q) are the combinations of levels that were recorded, of the limits that have
    levels."""

    limits: tuple[Limit, ...]
    bench: tuple[Limit, ...]
    met: Integers
    subspace: Subspace

    @classmethod
    def of(cls, table: Inputs) -> Self:
        """The domain of training rows: none of them lies outside.

        Parameters:
            table: The impacts that are learned from.

        Raises:
            ValueError: For no rows, or a NaN.
        """
        unknown = int(np.isnan(table.x).sum())
        if not len(table) or unknown:
            raise ValueError(
                f"{len(table)} impacts with {unknown} "
                f"unknown values; expected at least one, and none"
            )
        limits = tuple(
            Limit.of(p, column) for p, column in zip(table.predictors, table.x.T, strict=True)
        )
        met = np.unique(_positions(limits, table.x), axis=0)
        return cls(limits, _bench(table), met, Subspace.of(_encoded(limits, table.x)))

    @property
    def predictors(self) -> tuple[Predictor, ...]:
        """Those that may be asked about, in their order."""
        return tuple(limit.predictor for limit in self.limits)

    def outside(self, inputs: Inputs) -> list[tuple[OutOfRange, ...]]:
        """For each impact what lies outside, an empty tuple where nothing does.

        First each value by itself; where all are inside, their combination: levels that never met,
        then leverage. A combination is told by the predictor that contributes most.

        Parameters:
            inputs: The impacts that are asked about.

        Raises:
            ValueError: For other predictors than those of the domain.
        """
        if inputs.predictors != self.predictors:
            own_names, theirs = (
                ", ".join(p.name for p in ps) for ps in (self.predictors, inputs.predictors)
            )
            raise ValueError(f"inputs have predictors {theirs}; the domain is of {own_names}")
        limits_by_row: _Found = [[] for _ in range(len(inputs))]
        for limit, column in zip(self.limits, inputs.x.T, strict=True):
            _tell(limit, column, ~limit.inside(column), limits_by_row)
        self._tell_unmet(inputs.x, _clean(limits_by_row), limits_by_row)
        self._tell_far(inputs.x, _clean(limits_by_row), limits_by_row)
        for limit in self.bench:
            column = getattr(inputs, _BENCH[limit.predictor.name][0])
            # Not known is no error here: the bench is no predictor, and most models do not ask for
            # it.
            _tell(limit, column, ~limit.inside(column) & ~np.isnan(column), limits_by_row)
        return [tuple(row_limits) for row_limits in limits_by_row]

    def numbers(self, inputs: Inputs) -> Iterator[tuple[Limit, Floats]]:
        """The limits that are numbers, of predictors and of the bench, with the values (n,) that
        are asked about.

        Parameters:
            inputs: The n impacts that are asked about.
        """
        for limit, column in zip(self.limits, inputs.x.T, strict=True):
            if not limit.predictor.levels:
                yield limit, column
        for limit in self.bench:
            yield limit, getattr(inputs, _BENCH[limit.predictor.name][0])

    def _tell_unmet(self, x: Floats, rows: Integers, reasons: _Found) -> None:
        """Levels that never met; the one that most others never met is named, of equals the
        first."""
        at = [i for i, limit in enumerate(self.limits) if limit.values]
        pairs = unmet(self.met, _positions(self.limits, x[rows]))
        for number in np.unique(pairs[:, 0]):
            own_pairs = pairs[pairs[:, 0] == number, 1:]
            worst = int(np.bincount(own_pairs.ravel()).argmax())
            other = int(
                next(b if a == worst else a for a, b in own_pairs.tolist() if worst in (a, b))
            )
            row, (i, j) = rows[number], (at[worst], at[other])
            stranger = f"{self.limits[j].predictor.name} {_text(self.limits[j].shown(x[row, j]))}"
            reasons[row].append(
                self.limits[i].telling(x[row, i], f"was never recorded together with {stranger}")
            )

    def _tell_far(self, x: Floats, rows: Integers, reasons: _Found) -> None:
        """Combinations of high leverage, or off the subspace of the recorded ones."""
        distances = self.subspace.distances(_encoded(self.limits, x[rows]))
        columns = np.repeat(np.arange(len(self.limits)), [_width(limit) for limit in self.limits])
        for number in np.flatnonzero((distances.leverage > 1) | (distances.off > 1)):
            row = rows[number]
            worst = int(np.bincount(columns, weights=distances.shares[number]).argmax())
            how = "off" if distances.off[number] > 1 else "far from"
            reason = f"lies, with the other predictors, {how} every combination that was recorded"
            reasons[row].append(self.limits[worst].telling(x[row, worst], reason))

    def to_json(self) -> dict[str, Any]:
        """Plain data that `from_json` reads back."""
        return {
            "format": _FORMAT,
            "limits": [limit.as_json() for limit in self.limits],
            "bench": [limit.as_json() for limit in self.bench],
            "met": self.met.tolist(),
            "subspace": self.subspace.as_json(),
        }

    @classmethod
    def from_json(cls, data: dict[str, Any]) -> Self:
        """A domain that was written down.

        Parameters:
            data: What `to_json` gave.

        Raises:
            ValueError: For what is no domain of this format.
        """
        if not isinstance(data, dict) or data.get("format") != _FORMAT:
            raise ValueError(f"no validity domain of format {_FORMAT}; train the model anew")
        try:
            limits = tuple(Limit.from_json(limit) for limit in data["limits"])
            bench = tuple(Limit.from_json(limit) for limit in data["bench"])
            subspace = Subspace.from_json(data["subspace"])
            met = np.array(data["met"], dtype=np.int64).reshape(
                -1, sum(bool(limit.values) for limit in limits)
            )
            if (
                subspace.mean.size != sum(map(_width, limits))
                or {b.predictor.name for b in bench} - _BENCH.keys()
            ):
                raise ValueError("its parts do not belong together")
        except (KeyError, TypeError, ValueError) as error:
            raise ValueError(
                f"validity domain is damaged ({error!r}); train the model anew"
            ) from error
        return cls(limits, bench, met, subspace)


def _bench(table: Inputs) -> tuple[Limit, ...]:
    limits = []
    for name, (attribute, unit) in _BENCH.items():
        column = getattr(table, attribute)
        recorded = column[~np.isnan(column)]
        is_predictor = any(np.array_equal(column, predictor) for predictor in table.x.T)
        if recorded.size and not is_predictor:
            limits.append(Limit.of(Predictor(name, unit), recorded))
    return tuple(limits)


def _positions(limits: Sequence[Limit], x: Floats) -> Integers:
    """Positions (n x q) of the levels, of the columns that have levels."""
    columns = [positions(x[:, i], limit.values) for i, limit in enumerate(limits) if limit.values]
    return np.column_stack(columns) if columns else np.zeros((len(x), 0), dtype=np.int64)


def _encoded(limits: Sequence[Limit], x: Floats) -> Floats:
    """Numbers as they are, a category as a column for each level that was recorded (n x p)."""
    columns = [
        (x[:, [i]] == np.asarray(limit.values)).astype(np.float64)
        if limit.predictor.levels
        else x[:, [i]]
        for i, limit in enumerate(limits)
    ]
    return np.concatenate(columns, axis=1)


def _width(limit: Limit) -> int:
    return len(limit.values) if limit.predictor.levels else 1


def _clean(reasons: _Found) -> Integers:
    """Rows of which nothing is told yet."""
    return np.array(
        [row for row, row_limits in enumerate(reasons) if not row_limits], dtype=np.int64
    )


def _tell(limit: Limit, column: Floats, outside: Any, reasons: _Found) -> None:
    for row in np.flatnonzero(outside):
        reasons[row].append(limit.outside(float(column[row])))


def _text(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"


__all__ = ["Domain", "OutOfRange"]
