"""The form of the page that asks for a diagnosis: its fields into arguments, and arguments back
into its fields.

Every error names the field that it is about, so that the page shows it there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ...common.model_registry import models_extra, registry_of
from ..faults import FieldError
from .request import IN_USE, MODELS, DiagnoseArguments, full_name

#: Stage, what of it is compared, the unit of its tolerance, the tolerance that is used where the
#: field is empty.
STAGES = (
    ("gun", "velocity of the gun", "%", "1"),
    ("contact", "force of the contact", "%", "3"),
    ("plate", "spectrum of the plate", "dB", "0.5"),
)
FIELDS = ("simulator", *(stage[0] for stage in STAGES), "uncertain", "seed")


class UnknownValueError(LookupError):
    """A field names something that the store does not have. `field`: the name of its control."""

    def __init__(self, field: str, message: str) -> None:
        super().__init__(message)
        self.field = field


def arguments_of(
    campaign: str, form: Mapping[str, str], seed: int, only: Sequence[str], without: Sequence[str]
) -> DiagnoseArguments:
    """What the form asks for. Raises `FieldError`."""
    return DiagnoseArguments(
        campaign,
        simulator=form["simulator"].strip() or None,
        tolerances={
            stage: _positive(form[stage], stage, "The tolerance") / (1 if unit == "dB" else 100)
            for stage, _, unit, _ in STAGES
            if form[stage].strip()
        },
        uncertain=_uncertain(form["uncertain"]),
        seed=seed,
        with_effects=only,
        without_effects=without,
    )


def fields_of(arguments: Mapping[str, Any]) -> dict[str, str]:
    """The fields of the form that ask for stored arguments again; the inverse of `arguments_of`."""
    percents = {stage: 1 if unit == "dB" else 100 for stage, _, unit, _ in STAGES}
    tolerances = {
        stage: f"{percents[stage] * size:.9g}"
        for stage, size in arguments.get("tolerances", {}).items()
    }
    lines = [
        f"{name}={deviation:.9g}" for name, deviation in arguments.get("uncertain", {}).items()
    ]
    values = {
        "campaign": arguments.get("target", ""),
        "simulator": arguments.get("simulator") or "",
        **tolerances,
    }
    values |= {"uncertain": "\n".join(lines), "seed": str(arguments.get("seed") or "")}
    return {name: value for name, value in values.items() if value}


def check_simulator(db: str, text: str | None) -> None:
    """Raises `FieldError` for what names no simulator, `UnknownValueError` for a model that is not
    registered."""
    if text in (None, "nominal"):
        return
    assert text is not None
    name = text.removeprefix(MODELS)
    if name == text or not name:
        raise FieldError(
            "simulator",
            f"The simulator is {text!r}. Leave the field empty, or enter {MODELS}NAME@VERSION.",
        )
    if name.partition("@")[0] == IN_USE:
        return
    from ....training.registry.listing import chosen

    try:
        with models_extra():
            chosen(registry_of(db).versions(), name)
    except LookupError as error:
        raise UnknownValueError("simulator", str(error)) from error


def _uncertain(text: str) -> dict[str, float]:
    """`gun.friction_coefficient=0.05`, one a line."""
    values = {}
    for line in filter(None, map(str.strip, text.splitlines())):
        name, _, size = (part.strip() for part in line.partition("="))
        if "." not in name:
            message = (
                f"{line!r} names no number of the twin. Write one a line, such as "
                f"gun.friction_coefficient=0.05."
            )
            raise FieldError("uncertain", message)
        try:
            full_name(name)
        except ValueError as error:
            raise FieldError("uncertain", f"{line!r}: {error}") from error
        values[name] = _positive(size, "uncertain", f"The standard deviation of {name}")
    return values


def _positive(text: str, field: str, what: str) -> float:
    try:
        value = float(text.replace(",", "."))
    except ValueError:
        value = math.nan
    if not 0 < value < 100:
        raise FieldError(
            field, f"{what} is {text.strip()!r}. Enter a number above 0 and below 100."
        )
    return value
