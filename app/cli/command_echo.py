"""The command as typed, without the secrets in it: it is stored with every row that the command writes."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...schema.addresses import HIDDEN, shown, without_secrets

#: Options whose value is a secret whatever it looks like (a test finds those that are missing here).
SECRET_OPTIONS = frozenset({"--token"})
#: Options whose value is an address.
_ADDRESSES = frozenset({"--db", "--mlflow", "--scheduler"})


def command_line(arguments: Sequence[str]) -> str:
    """`arguments` as of `sys.argv`, in one line."""
    program = Path(arguments[0]).name
    before, words = "", ["pyroshock" if program == "__main__.py" else program]  # as `python -m pyroshock` calls it
    for word in arguments[1:]:
        words.append(_shown(word, before))
        before = word
    return " ".join(words)


def _shown(word: str, before: str) -> str:
    option, equals, value = word.partition("=")
    if before in SECRET_OPTIONS:
        return HIDDEN
    if equals and option in SECRET_OPTIONS:
        return f"{option}={HIDDEN}"
    if equals and option in _ADDRESSES:
        return f"{option}={shown(value)}"
    return shown(word) if before in _ADDRESSES or "://" in word else without_secrets(word)
