"""Effects as text: `gun.back_pressure`, or `gun.blow_by:clearance_m=0.0005,other=1`."""

from __future__ import annotations

from ...twin.effects import Effect, effect


def parse_effect(text: str, name: str) -> Effect:
    """The effect with its parameters in SI.

    Raises `LookupError` for an effect that the catalogue does not have, and `ValueError` that says `name`, the argument
    or option, for a value that is no number.
    """
    identity, _, rest = text.partition(":")
    values: dict[str, float] = {}
    for part in filter(None, rest.split(",")):
        parameter, _, number = part.partition("=")
        try:
            values[parameter.strip()] = float(number)
        except ValueError as error:
            raise ValueError(f"{name} {text!r}: {part!r}; expected NAME=VALUE in SI, such as gain=1.02") from error
    return effect(identity.strip(), **values)
