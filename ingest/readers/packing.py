"""Packed numbers, by the conventions of netCDF ("NetCDF Users Guide", appendix B; CF conventions,
2.5.1 and 8.1)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .base import RecordingError

Take = Callable[[int, int], NDArray[Any]]

_FILLS = ("_FillValue", "missing_value")
_LIMITS = ("valid_range", "valid_min", "valid_max")


@dataclass(frozen=True)
class NetcdfPacking:
    """value = stored * scale + offset; NaN where stored is one of `fills`, below `lowest` or above
    `highest`.

    `unsigned`: stored are the bits of numbers without a sign.
    """

    scale: float = 1.0
    offset: float = 0.0
    fills: tuple[float, ...] = ()
    lowest: float | None = None
    highest: float | None = None
    unsigned: bool = False

    @property
    def changes(self) -> bool:
        """Whether a value can be another than the stored number."""
        return self != NetcdfPacking()

    def dtype(self, stored: np.dtype[Any]) -> np.dtype[Any]:
        """That of the values."""
        return np.dtype(np.float64) if self.changes else stored

    def unpacked(self, take: Take) -> Take:
        """`take` that gives values."""
        return (lambda start, stop: self.values(take(start, stop))) if self.changes else take

    def values(self, stored: NDArray[Any]) -> NDArray[np.float64]:
        """The values of stored numbers (n,)."""
        if self.unsigned:
            stored = stored.view(stored.dtype.str.replace("i", "u"))
        missing = np.isin(stored, self.fills)
        if self.lowest is not None:
            missing |= stored < self.lowest
        if self.highest is not None:
            missing |= stored > self.highest
        values = stored.astype(np.float64) * self.scale + self.offset
        values[missing] = np.nan
        return np.asarray(values)


def packing_of(
    path: Path, name: str, attributes: Mapping[str, Any], stored: np.dtype[Any]
) -> NetcdfPacking:
    """The packing that the attributes of a data set of `stored` numbers state.

    Raises `RecordingError` for an attribute of it that is no number.
    """
    if stored.kind not in "iuf":
        return NetcdfPacking()

    def numbers(key: str) -> list[float]:
        if key not in attributes:
            return []
        values = attributes[key] if isinstance(attributes[key], list) else [attributes[key]]
        try:
            return [float(value) for value in values]
        except (TypeError, ValueError):
            raise RecordingError(
                f"{path.name}: {name!r} has {key} = {attributes[key]!r}; expected a number"
            ) from None

    def number(key: str, default: float | None) -> Any:
        values = numbers(key)
        if len(values) > 1:
            raise RecordingError(f"{path.name}: {name!r} has {key} = {values}; expected one number")
        return values[0] if values else default

    limits = numbers("valid_range")
    if len(limits) not in (0, 2):
        raise RecordingError(
            f"{path.name}: {name!r} has valid_range = {limits}; expected two numbers"
        )
    return NetcdfPacking(
        scale=number("scale_factor", 1.0),
        offset=number("add_offset", 0.0),
        fills=tuple(value for key in _FILLS for value in numbers(key) if not np.isnan(value)),
        lowest=number("valid_min", limits[0] if limits else None),
        highest=number("valid_max", limits[1] if limits else None),
        unsigned=str(attributes.get("_Unsigned", "false")).lower() == "true" and stored.kind == "i",
    )
