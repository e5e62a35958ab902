"""The sampling rate that the lines above the numbers of a text state."""

from __future__ import annotations

import re
from pathlib import Path

from ...files.number_notation import Notation
from .base import RecordingError, rate_from_step
from .contents import RATE_NAMES, RATE_UNITS, TIME_UNITS, name_and_unit
from .text_table import Layout

_SPOKEN_RATES = frozenset(
    {
        "sampling_frequency",
        "sample_frequency",
        "samplerate",
        "samplingrate",
        "sample_rate",
        "samples_per_second",
    }
)
_SPOKEN_STEPS = frozenset(
    {
        "sample_interval",
        "sampling_interval",
        "sampling_period",
        "sample_period",
        "time_step",
        "dt",
        "delta_t",
    }
)
_NUMBER_AND_UNIT = re.compile(r"([-+\d.,'eE]+|nan|inf)\s*([A-Za-zµμ/]*)")
#: A step printed with fewer digits than these is taken as it is.
_PRINTED_STEP = 5e-6
_AGREEMENT = 1e-3


def stated_rate(path: Path, layout: Layout, notation: Notation) -> float | None:
    """The rate in hertz of lines such as `# fs = 51200`, `Sampling rate [kHz]: 51,2` or `Sample
    Interval,4e-09`.

    None where no line says it. Raises `RecordingError` for a value that is no rate, and for two
    that differ.
    """
    rates = {
        key: _rate(path, key, layout.statements[key], layout.time_unit, is_step, notation)
        for key, is_step in rate_fields(layout).items()
    }
    names = list(rates)
    for name in names[1:]:
        if abs(rates[name] - rates[names[0]]) > _AGREEMENT * abs(rates[names[0]]):
            raise RecordingError(
                f"{path.name}: states two sampling rates, {rates[names[0]]} Hz ({names[0]}) and "
                f"{rates[name]} Hz ({name}); expected one"
            )
    return rates[names[0]] if names else None


def rate_fields(layout: Layout) -> dict[str, bool]:
    """The statements that say the rate; True for those that say the step."""
    fields = {}
    for key in layout.statements:
        spoken = re.sub(r"[\s-]+", "_", name_and_unit(key)[0].lower())
        if key == layout.step or spoken in _SPOKEN_STEPS:
            fields[key] = True
        elif key == layout.rate or spoken in RATE_NAMES | _SPOKEN_RATES:
            fields[key] = False
    return fields


def _rate(
    path: Path,
    key: str,
    value: str | list[str],
    time_unit: str | None,
    is_step: bool,
    notation: Notation,
) -> float:
    unit = name_and_unit(key)[1] or (time_unit if is_step else None)
    match = _NUMBER_AND_UNIT.fullmatch(value) if isinstance(value, str) else None
    word = (match.group(2) if match else "") or unit or ("s" if is_step else "")
    scale = (TIME_UNITS if is_step else RATE_UNITS).get(word.lower())
    number = _number(match.group(1), notation) if match else None
    if scale is None or number is None or number != number or (is_step and number <= 0.0):
        expected = "a step above 0 in s, ms, us or ns" if is_step else "a number in Hz, kHz or MHz"
        in_unit = f" in {word}" if unit and isinstance(value, str) else ""
        raise RecordingError(
            f"{path.name}: {key!r} is {value!r}{in_unit}; expected {expected}, one for all channels"
        )
    return rate_from_step(number * scale, _precision(str(value))) if is_step else number * scale


def _number(text: str, notation: Notation) -> float | None:
    try:
        return float(text)
    except ValueError:
        pass
    try:
        return float(notation.plain(text))
    except ValueError:
        return None


def _precision(number: str) -> float:
    """Relative half of the last digit of a step of six digits or more; of fewer, 1e-9: it is meant
    exactly."""
    digits = len(re.sub(r"[eE].*|[^\d]", "", number).lstrip("0"))
    return _PRINTED_STEP if digits == 6 else 1e-9
