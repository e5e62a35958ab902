"""Effects that a nominal stage leaves out: what every one of them tells, and where they are found.

One effect is one file in the `effects` folder of its stage: a frozen dataclass whose fields are its
parameters. Nothing lists the files: a new one is found by being there. Other packages add theirs as
entry points. A stage without effects is the nominal physics.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
from abc import ABC
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from functools import cache
from typing import Any, ClassVar, TypeVar

import numpy as np

from ..array_types import Floats
from ..plugins import EFFECTS, Loaded, load

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
    """A field of an effect, which makes a `Parameter`. SI; the unit stands in the field's name,
    too.

    Parameters:
        meaning: What the value is, in a few words.
        unit: Its SI unit; "" for a pure number.
        default: The value of an effect that is made without one.
        low: The least value allowed.
        high: The greatest value allowed.
        off: The value at which the effect does nothing.
        likely: The range, inside the allowed one, in which a diagnosis looks for the value; by
            default None: the value is not looked for, and the default stays.
        typical: Standard deviation that data sheets and calibrations give for an error of either
            sign; by default None: there is no such sheet.
        owner: What the value belongs to, and from whose one level to the next it may differ:
            "bench" (default), "bullet", "tip", "face", "layer", "plate", "mode band", "channel" or
            "session".
        plausible: The range that the part can have by its physics; by default None: nothing is
            known.
    """
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
    #: As a sentence names it before "causes 61 % of the error": "the humidity of the gas"; and what
    #: completes "measure ...". Reports have the words of shipped effects; others bring theirs.
    subject: ClassVar[str] = ""
    check: ClassVar[str] = ""

    def __post_init__(self) -> None:
        for item in self.parameters():
            value = getattr(self, item.name)
            # A diagnosis makes a hundred thousand effects, mostly of single numbers.
            if isinstance(value, float) and item.low <= value <= item.high:
                continue
            values = np.asarray(value, dtype=np.float64)
            good = (values >= item.low) & (values <= item.high)
            if not good.all():
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
    """Every effect there is, by id: those that are shipped in the order of stages and ids, then
    those of other packages by id. Raises `PluginError` for an id that is taken."""
    return {**_shipped(), **added_effects().objects}


@cache
def added_effects() -> Loaded[type[Effect]]:
    """Those of other packages. Raises `PluginError` for an id that is taken."""
    return load(EFFECTS, _accepted, _shipped())


@cache
def _shipped() -> Mapping[str, type[Effect]]:
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


#: Of an id; texts are searched for it.
_ID = re.compile(r"[a-z]+\.[a-z_]+")
_MOST_IN_REGIME = 3


def _accepted(name: str, kind: Any) -> type[Effect]:
    """An effect of another package that keeps the contract of `docs/how-to/extend.md`."""
    stage = name.partition(".")[0]
    bases = {shipped.stage(): _base_of_stage(shipped) for shipped in _shipped().values()}
    if not _ID.fullmatch(name) or stage not in bases:
        raise ValueError(f"its id is {name!r}; expected STAGE.NAME, STAGE being {', '.join(bases)}")
    if not (isinstance(kind, type) and issubclass(kind, bases[stage])):
        base = f"{bases[stage].__module__}.{bases[stage].__name__}"
        raise TypeError(f"expected a class derived from {base}: {kind!r}")
    if not is_dataclass(kind) or not kind.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        raise TypeError(f"{kind.__name__} is no frozen dataclass")
    if getattr(kind, "id", None) != name:
        raise ValueError(
            f"its id is {getattr(kind, 'id', None)!r}; expected the entry point's name"
        )
    for text in ("law", "source", "subject", "check"):
        if not str(getattr(kind, text, "")).strip():
            raise ValueError(f"{kind.__name__}.{text} is empty; expected one line of text")
    if plain := [item.name for item in fields(kind) if _KEY not in item.metadata]:
        raise TypeError(f"the field {plain[0]!r} is not made by pyroshock.twin.effects.parameter")
    _check_parameters(kind)
    return kind


def _base_of_stage(kind: type[Effect]) -> type[Effect]:
    return next(base for base in kind.__mro__ if Effect in base.__bases__)


def _check_parameters(kind: type[Effect]) -> None:
    parameters = {item.name: item for item in kind.parameters()}
    for item in parameters.values():
        ends = item.likely or (item.low, item.high)
        values = (item.default, item.off, *ends)
        if not all(item.low <= value <= item.high for value in values) or ends[0] >= ends[1]:
            raise ValueError(
                f"{item.name}: default {item.default:g}, off {item.off:g} and likely range "
                f"{item.likely} do not lie within {item.low:g} to {item.high:g}"
            )
    searched = [item.name for item in parameters.values() if item.likely is not None]
    if not searched:
        raise ValueError(f"no parameter of {kind.__name__} has a likely range")
    for regime in kind.regimes or (tuple(searched),):
        if not set(regime) <= set(searched) or not 0 < len(regime) <= _MOST_IN_REGIME:
            raise ValueError(
                f"the regime {regime} is not one to {_MOST_IN_REGIME} of the parameters with a "
                f"likely range: {', '.join(searched)}"
            )
    if not kind.prior_odds > 0:
        raise ValueError(f"prior_odds is {kind.prior_odds}; expected a number above zero")


def get_effect_kind(identity: str) -> type[Effect]:
    """The class of an effect.

    Parameters:
        identity: Its id in the catalogue, such as "gun.back_pressure".

    Raises:
        LookupError: For an id that is not there, with those that there are; for an effect of
            another package that cannot be used, with the cause.
    """
    if identity in catalogue():
        return catalogue()[identity]
    if identity in added_effects().failures:
        raise LookupError(added_effects().failures[identity])
    raise LookupError(
        f"no effect {identity!r}; there are: {', '.join(catalogue())}; an effect of another "
        f"package is there when that package is installed (pyroshock plugins)"
    )


def effect(identity: str, **parameters: Value) -> Effect:
    """An effect by its id.

    Parameters:
        identity: Its id in the catalogue, such as "gun.back_pressure".
        parameters: Values by the name of the parameter, SI: one number, or an array (n,) for n
            shots. A parameter that is not given has its default.

    Raises:
        LookupError: For an effect there is not.
        ValueError: For a parameter that the effect has not, and a value outside of its range.
    """
    kind = get_effect_kind(identity)
    parameter_names = [item.name for item in kind.parameters()]
    if unknown := [name for name in parameters if name not in parameter_names]:
        raise ValueError(
            f"{identity} has no parameter {unknown[0]!r}; it has: {', '.join(parameter_names)}"
        )
    return kind(**parameters)


def effect_from_json(table: Mapping[str, Any]) -> Effect:
    """The inverse of `Effect.as_json`.

    Parameters:
        table: The id under "id", and a number or a list for each parameter.

    Raises:
        LookupError: As `effect`.
        ValueError: As `effect`.
    """
    values = {
        k: np.asarray(v, dtype=np.float64) if isinstance(v, list) else float(v)
        for k, v in table.items()
        if k != "id"
    }
    return effect(str(table["id"]), **values)


def checked_effects(effects: Iterable[Effect], kind: type[E]) -> tuple[E, ...]:
    """Effects of one stage, in the order given.

    Parameters:
        effects: Effects that act together.
        kind: The base class of the stage's effects, such as `GunEffect`.

    Raises:
        TypeError: For an effect of another stage.
        ValueError: For an effect that is given twice.
    """
    given: list[E] = []
    for effect in effects:
        if not isinstance(effect, kind):
            raise TypeError(f"{effect.id} does not act here: expected effects of {kind.__name__}")
        if effect.id in {other.id for other in given}:
            raise ValueError(f"{effect.id} is given twice")
        given.append(effect)
    return tuple(given)
