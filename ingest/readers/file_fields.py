"""No field of a file that changes the meaning of a number is passed over.

A reader lists the fields of its format as rules (`fields`). A field is used, or it is known to
change no number, or the file is refused with the field, its value and what to do. A field that no
rule names is handed on as a note where its name says nothing of time, scale, unit, class or gaps,
or where its value says nothing (a scale of 1, an offset of 0); otherwise the file is refused until
the laboratory says that the field changes no number (`harmless_fields` of `[recordings]`,
`--harmless-field` of a command).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from .base import AS_IN_FILE, ReadingOptions, RecordingError
from .field_names import Meaning, meaning_of
from .field_rules import FieldRule, Treatment

#: Of a stated rate or step and the one in use.
_AGREEMENT = 1e-3
#: Texts that leave a field open.
_NO_TEXT = frozenset(
    {
        "",
        "-",
        "--",
        "none",
        "null",
        "n/a",
        "na",
        "nan",
        "unknown",
        "undefined",
        "not set",
        "default",
    }
)
_OFF = frozenset({"0", "no", "off", "false", "none", "normal", "linear", "real", "time"})


def refuse_unread_fields(
    path: Path,
    rules: Sequence[FieldRule],
    fields: Mapping[str, Any],
    place: str,
    options: ReadingOptions = AS_IN_FILE,
    *,
    unit: str | None = None,
    rate_hz: float | None = None,
) -> None:
    """Raise `RecordingError` where `unread_field` finds one.

    `place` says whose fields they are, as a sentence begins: "the file", "'force'".
    """
    reason = unread_field(rules, fields, options, unit=unit, rate_hz=rate_hz)
    if reason is not None:
        raise RecordingError(f"{path.name}: {place} {reason}")


def unread_field(
    rules: Sequence[FieldRule],
    fields: Mapping[str, Any],
    options: ReadingOptions = AS_IN_FILE,
    *,
    unit: str | None = None,
    rate_hz: float | None = None,
) -> str | None:
    """What the first field says that may change a number and is not used, from "has" on; None where
    there is none.

    The first rule that matches a field counts. `unit` and `rate_hz` are those in use, which a field
    without a rule may repeat. As `Array.obstacle` the text refuses one channel, and the other
    channels of the file can be read.
    """
    for name, value in fields.items():
        if is_harmless(name, options):
            continue
        rule = next((rule for rule in rules if rule.matches(name)), None)
        if rule is not None:
            if rule.treatment is Treatment.REFUSED and not any(
                _same(value, neutral) for neutral in rule.neutral
            ):
                return f"has {name} = {_shown(value)}; {rule.reason}"
        elif _may_change_numbers(name, value, unit, rate_hz):
            return (
                f"has the field {name!r} = {_shown(value)}, which the reader does not know and "
                "which may change what the numbers mean; apply it and save again without it, or, "
                f'where it changes no number, write harmless_fields = ["{name}"] under '
                "[recordings] of campaign.toml (--harmless-field of a command)"
            )
    return None


def is_harmless(name: str, options: ReadingOptions) -> bool:
    """Whether the laboratory says that a field of this name changes no number: it is then neither
    used nor refused."""
    return any(fnmatchcase(name.lower(), pattern.lower()) for pattern in options.harmless_fields)


def _may_change_numbers(name: str, value: Any, unit: str | None, rate_hz: float | None) -> bool:
    """Whether an unknown field announces something by its name and does so by its value."""
    meaning = meaning_of(name)
    if meaning is None or _says_nothing(value):
        return False
    number = _number(value)
    match meaning:
        case Meaning.SCALE:
            return _numeric(value) and number != 1.0
        case Meaning.CALIBRATION:
            return _numeric(value) and number != 1.0 and unit in (None, "", "V", "mV")
        case Meaning.OFFSET | Meaning.COUNT:
            return _numeric(value) and number != 0.0
        case Meaning.RATE:
            return _numeric(value) and not _states_rate(number, rate_hz)
        case Meaning.FILL_VALUE:
            return _numeric(value)
        case Meaning.UNIT:
            return unit is None or str(_plain(value)).strip() != unit
        case Meaning.KIND:
            return str(_plain(value)).strip().lower() not in _OFF


def _says_nothing(value: Any) -> bool:
    plain = _plain(value)
    if (
        plain is None
        or plain is False
        or (isinstance(plain, str) and plain.strip().lower() in _NO_TEXT)
    ):
        return True
    if isinstance(plain, list | tuple):
        return all(map(_says_nothing, plain))
    return isinstance(plain, float) and np.isnan(plain)


def _plain(value: Any) -> Any:
    if isinstance(value, np.datetime64):
        return str(value)
    if isinstance(value, np.ndarray | np.generic):
        value = value.reshape(-1)[0].item() if value.size == 1 else value.tolist()
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value


def _numeric(value: Any) -> bool:
    """Whether a value is a number, several, or a text that begins with a number: `2.5 mV/g`, and no
    date."""
    plain = _plain(value)
    return (
        isinstance(plain, bool | int | float | complex | list | tuple) or _number(plain) is not None
    )


def _number(value: Any) -> float | None:
    plain = _plain(value)
    if isinstance(plain, str):
        words = plain.strip().replace(",", ".").split()
        plain = words[0] if words else ""
    try:
        return float(plain)
    except (TypeError, ValueError):
        return None


def _states_rate(number: float | None, rate_hz: float | None) -> bool:
    """Whether a number is the rate in use in Hz, kHz or MHz, or its step in s, ms, us or ns."""
    if not number or rate_hz is None:
        return False
    candidates = [number * scale for scale in (1.0, 1e3, 1e6)] + [
        scale / number for scale in (1.0, 1e3, 1e6, 1e9)
    ]
    return any(abs(candidate - rate_hz) <= _AGREEMENT * rate_hz for candidate in candidates)


def _same(value: Any, neutral: Any) -> bool:
    if isinstance(neutral, str) or isinstance(_plain(value), str):
        return str(_plain(value)).strip().lower() == str(neutral).lower()
    try:
        return bool(np.all(np.asarray(value) == neutral))
    except (TypeError, ValueError):
        return False


def _shown(value: Any) -> str:
    text = repr(_plain(value))
    return text if len(text) <= 80 else f"{text[:80]}…"
