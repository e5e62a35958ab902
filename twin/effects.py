"""Effects that a nominal stage leaves out: what every one of them tells, and where they are found.

One effect is one file in the `effects` folder of its stage: a frozen dataclass whose fields are its
parameters. Nothing lists the files: a new one is found by being there. A stage without effects is
the nominal physics.
"""

from __future__ import annotations

import importlib
import pkgutil
from abc import ABC
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields
from functools import cache
from typing import Any, ClassVar, TypeVar

import numpy as np

from ..array_types import Floats

#: A parameter's value: one for all shots, or one for each (n,).
Value = float | Floats

_KEY = "parameter"
E = TypeVar("E", bound="Effect")


@dataclass(frozen=True)
class Parameter:
    """One parameter of an effect: unit ("" for a pure number), default and allowed range, ends
    included.

    `off` is the value at which the effect does nothing. `likely` is where a diagnosis looks for it,
    inside the range: what benches have, not what is possible. None: not looked for, the default
    stays. `typical`: the standard deviation that data sheets and calibrations give for an error of
    either sign; None where there is no such sheet. `owner`: what the parameter belongs to, and from
    whose one level to the next it may differ: "bench", "bullet", "tip", "face" (what the tip
    meets), "layer", "plate", "mode band", "channel" or "session". `plausible`: what the part can
    be, by its physics; a fitted value beyond it says that the law stands for something else. None:
    nothing is known.
    """

    name: str
    meaning: str
    unit: str
    default: float
    low: float
    high: float
    off: float
    likely: tuple[float, float] | None
    typical: float | None = None
    owner: str = "bench"
    plausible: tuple[float, float] | None = None


def parameter(
    meaning: str,
    unit: str,
    *,
    default: float,
    low: float,
    high: float,
    off: float,
    likely: tuple[float, float] | None = None,
    typical: float | None = None,
    owner: str = "bench",
    plausible: tuple[float, float] | None = None,
) -> Any:
    """A field of an effect. SI; the unit stands in the field's name, too."""
    return field(
        default=default,
        metadata={_KEY: (meaning, unit, low, high, off, likely, typical, owner, plausible)},
    )


@dataclass(frozen=True)
class Effect(ABC):
    """What a nominal stage leaves out. Parameters are numbers, or arrays (n,) that go with n shots.

    Raises `ValueError` naming effect, parameter, value and range for a value outside of its range.
    """

    #: Of the catalogue: "gun.back_pressure".
    id: ClassVar[str]
    #: The equation in one line, as the docs show it.
    law: ClassVar[str]
    #: Paper, book or standard that it is from.
    source: ClassVar[str]
    #: Parameters that a diagnosis looks for together while the others are off: laws of one cause
    #: for different circumstances. Empty: all that have a likely range, at once.
    regimes: ClassVar[tuple[tuple[str, ...], ...]] = ()
    #: How much likelier than other effects it is to act on a bench, before anything was measured.
    prior_odds: ClassVar[float] = 1.0

    def __post_init__(self) -> None:
        for item in self.parameters():
            values = np.asarray(getattr(self, item.name), dtype=np.float64)
            good = (values >= item.low) & (values <= item.high)
            if not np.all(good):
                raise ValueError(
                    f"{self.id}: {item.name} = {float(values[~good].flat[0])!r}; expected "
                    f"{item.low:g} to {item.high:g} {item.unit}".rstrip()
                )

    @classmethod
    def parameters(cls) -> tuple[Parameter, ...]:
        """Its parameters in order."""
        return _parameters_of(cls)

    @classmethod
    def stage(cls) -> str:
        """gun, contact, plate or sensor."""
        return cls.id.split(".")[0]

    def as_json(self) -> dict[str, Any]:
        """`{"id": ..., parameter: value, ...}`; arrays become lists."""
        values = {item.name: getattr(self, item.name) for item in self.parameters()}
        return {
            "id": self.id,
            **{k: v.tolist() if isinstance(v, np.ndarray) else float(v) for k, v in values.items()},
        }


@cache
def _parameters_of(kind: type[Effect]) -> tuple[Parameter, ...]:
    return tuple(_parameter(item) for item in fields(kind))


def _parameter(item: Field[Any]) -> Parameter:
    meaning, unit, *others = item.metadata[_KEY]
    assert item.default is not MISSING
    return Parameter(item.name, meaning, unit, float(item.default), *others)


_FOLDERS = ("gun", "contact", "plate", "sensors")


@cache
def catalogue() -> Mapping[str, type[Effect]]:
    """Every effect there is, by id, in the order of stages and ids."""
    effects_by_id: dict[str, type[Effect]] = {}
    for folder in _FOLDERS:
        package = importlib.import_module(f".{folder}.effects", __package__)
        for name in sorted(module.name for module in pkgutil.iter_modules(package.__path__)):
            module = importlib.import_module(f"{package.__name__}.{name}")
            for thing in vars(module).values():
                if (
                    isinstance(thing, type)
                    and issubclass(thing, Effect)
                    and thing.__module__ == module.__name__
                ):
                    effects_by_id[thing.id] = thing
    return effects_by_id


def effect(identity: str, **parameters: Value) -> Effect:
    """An effect by its id. Raises `LookupError` for one there is not, `ValueError` for a parameter
    it has not."""
    if identity not in catalogue():
        raise LookupError(f"no effect {identity!r}; there are: {', '.join(catalogue())}")
    kind = catalogue()[identity]
    parameter_names = [item.name for item in kind.parameters()]
    if unknown := [name for name in parameters if name not in parameter_names]:
        raise ValueError(
            f"{identity} has no parameter {unknown[0]!r}; it has: {', '.join(parameter_names)}"
        )
    return kind(**parameters)


def effect_from_json(table: Mapping[str, Any]) -> Effect:
    """The inverse of `Effect.as_json`."""
    values = {
        k: np.asarray(v, dtype=np.float64) if isinstance(v, list) else float(v)
        for k, v in table.items()
        if k != "id"
    }
    return effect(str(table["id"]), **values)


def checked_effects(effects: Iterable[Effect], kind: type[E]) -> tuple[E, ...]:
    """Effects of one stage. Raises `TypeError` for another stage's, `ValueError` for one given
    twice."""
    given: list[E] = []
    for effect in effects:
        if not isinstance(effect, kind):
            raise TypeError(f"{effect.id} does not act here: expected effects of {kind.__name__}")
        if effect.id in {other.id for other in given}:
            raise ValueError(f"{effect.id} is given twice")
        given.append(effect)
    return tuple(given)
