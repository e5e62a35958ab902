"""No field of a file that changes the meaning of a number is passed over.

A reader lists the fields of its format as rules (`fields`). A field is used, or it is known to change no number, or the
file is refused with the field, its value and what to do. A field that no rule names is handed on as a note where its
name says nothing of time, scale, unit, class or gaps; otherwise the file is refused until the laboratory says that the
field changes no number (`harmless_fields` of `[recordings]`, `--harmless-field` of a command).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from .base import AS_IN_FILE, ReadingOptions, RecordingError
from .field_rules import FieldRule, Treatment

#: Words of a name that announce time, scale, unit, class or gaps.
_CHANGES_NUMBERS = re.compile(
    r"(?<![a-z])(?:scal(?:e|es|ing)|factors?|gains?|offsets?|slope|intercept|coeff\w*|polynomial|calib\w*|sensitivity|"
    r"multiplier|exponent|units?|rate|fs|freq\w*|increment|interval|step|period|delta|dt|t0|x0|time|times|start|delay|"
    r"skew|pre ?trigger|missing|fill ?value|fill|no ?data|no ?value|gaps?|dropouts?|invalid|over ?range|polarity|"
    r"inverted|invert|zero|bias|lsb|dimension|domain|axis)(?![a-z])",
    re.IGNORECASE,
)
_CAMEL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")


def may_change_numbers(name: str) -> bool:
    """Whether the name of an unknown field has a word that announces time, scale, unit, class or gaps."""
    words = re.sub(r"[^A-Za-z0-9]+|(?<=[a-z])(?=\d{2,})", " ", _CAMEL.sub(" ", name))
    return _CHANGES_NUMBERS.search(words) is not None


def refuse_unread_fields(
    path: Path,
    rules: Sequence[FieldRule],
    fields: Mapping[str, Any],
    place: str,
    options: ReadingOptions = AS_IN_FILE,
) -> None:
    """Raise `RecordingError` for a field that may change what a number means and that the reader does not use.

    `place` says whose fields they are, as a sentence begins: "the file", "'force'". The first rule that matches counts.
    """
    for name, value in fields.items():
        if any(fnmatchcase(name.lower(), pattern.lower()) for pattern in options.harmless_fields):
            continue
        rule = next((rule for rule in rules if rule.matches(name)), None)
        if rule is None:
            if may_change_numbers(name):
                raise RecordingError(
                    f"{path.name}: {place} has the field {name!r} = {_shown(value)}, which the reader does not know and "
                    "which may change what the numbers mean; apply it and save again without it, or, where it changes "
                    f'no number, write harmless_fields = ["{name}"] under [recordings] of campaign.toml '
                    "(--harmless-field of a command)"
                )
        elif rule.treatment is Treatment.REFUSED and not any(_same(value, neutral) for neutral in rule.neutral):
            raise RecordingError(f"{path.name}: {place} has {name} = {_shown(value)}; {rule.reason}")


def _same(value: Any, neutral: Any) -> bool:
    if isinstance(neutral, str) or isinstance(value, str):
        return str(value).strip().lower() == str(neutral).lower()
    try:
        return bool(np.all(np.asarray(value) == neutral))
    except (TypeError, ValueError):
        return False


def _shown(value: Any) -> str:
    text = repr(value.tolist() if isinstance(value, np.ndarray | np.generic) else value)
    return text if len(text) <= 80 else f"{text[:80]}…"
