"""What the name of an unknown field announces: a scale, an offset, a rate, a unit, a class or
gaps."""

from __future__ import annotations

import re
from enum import Enum, auto
from functools import lru_cache


class Meaning(Enum):
    """What a field would change if it were used."""

    SCALE = auto()  # a factor: 1 changes nothing
    CALIBRATION = (
        auto()
    )  # volts per unit: changes nothing where the samples are in the unit already
    OFFSET = auto()  # of values or of time: 0 changes nothing
    RATE = auto()  # a rate or a step: changes nothing where it is the one in use
    UNIT = auto()
    FILL_VALUE = auto()  # stands for samples that are missing
    COUNT = auto()  # of what is missing or out of range: 0 changes nothing
    KIND = auto()  # polarity, domain: a word


#: Words that make a field a remark on another: `calibration date`, `unit under test`, `scale name`.
_REMARK = re.compile(
    r"\b(?:dates?|due|expir\w*|until|serial|sn|certificate|ids?|names?|labels?|comments?|remarks?|"
    r"notes?|description|operator|user|version|model|manufacturer|lab|laboratory|zone|files?|"
    r"paths?|under test|colou?r|author|source|mode|type|status|state|revision)\b"
)
_MEANINGS: tuple[tuple[Meaning, re.Pattern[str]], ...] = (
    (
        Meaning.FILL_VALUE,
        re.compile(r"\b(?:fill ?values?|missing ?values?|no ?data(?: ?values?)?|no ?values?)\b"),
    ),
    (
        Meaning.COUNT,
        re.compile(
            r"\b(?:gaps?|dropouts?|(?:lost|missing) samples|over ?ranges?|overflows?|invalid)\b"
        ),
    ),
    (
        Meaning.CALIBRATION,
        re.compile(r"\b(?:sensitivity|calib\w*|volts? per \w+|mv per \w+|full ?scale)\b"),
    ),
    (Meaning.UNIT, re.compile(r"\bunits?\b")),
    (Meaning.KIND, re.compile(r"\b(?:polarity|invert(?:ed)?|domain)\b")),
    (
        Meaning.RATE,
        re.compile(
            r"\b(?:sampl\w*|acquisition|scan|recording|data|time|x)[ _]?"
            r"(?:rate|freq\w*|interval|period|step|increment|delta|spacing|resolution)\b|"
            r"^(?:rate|fs|frequency|freq|interval|increment|dt|delta t|delta x|delta|dx|"
            r"xinc|x inc|time base|timebase)$|\bsamplerate\b"
        ),
    ),
    (
        Meaning.OFFSET,
        re.compile(
            r"\b(?:offsets?|intercept|delays?|skew|pre ?trigger|t ?0|x ?0|x ?zero|y ?zero|x "
            r"?origin|y ?origin|lag|time shift|start time|first time|start s|t start|begin "
            r"time|delay time)\b|^(?:start|bias)$"
        ),
    ),
    (
        Meaning.SCALE,
        re.compile(
            r"\b(?:scal(?:e|es|ing)|gains?|slope|polynomial|multiplier|exponent|lsb|y "
            r"?increment|attenuation)\b|\bper "
            r"count\b|(?:^|\b(?:conversion|unit|multiplication|correction|linear|amplification) "
            r")(?:factors?|coeff\w*)\b|^conversion$"
        ),
    ),
)
_CAMEL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")
_BETWEEN_WORDS = re.compile(r"[^A-Za-z0-9]+")


@lru_cache(maxsize=4096)
def meaning_of(name: str) -> Meaning | None:
    """What the name of a field announces, by its words; None for a name that says nothing of the
    numbers."""
    words = _BETWEEN_WORDS.sub(" ", _CAMEL.sub(" ", name)).strip().lower()
    if _REMARK.search(words):
        return None
    return next((meaning for meaning, pattern in _MEANINGS if pattern.search(words)), None)
