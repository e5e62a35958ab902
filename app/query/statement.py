"""An SQL statement as it was typed: its first word, its parameters, and the form that each driver takes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

#: What is no code: quoted text and names, comments; then casts (`::`) and parameters (`:name`).
_TOKENS = re.compile(
    r"(?P<quoted>'(?:[^']|'')*'|\"(?:[^\"]|\"\")*\")"
    r"|(?P<comment>--[^\n]*|/\*.*?\*/)"
    r"|(?P<cast>::)"
    r"|:(?P<parameter>[A-Za-z_]\w*)",
    re.DOTALL,
)
_WORD = re.compile(r"[A-Za-z_]\w*")

#: First words of statements that only read.
READING = ("SELECT", "WITH", "VALUES")

#: The command that does what a refused statement would do.
_INSTEAD = {
    "INSERT": "new rows come with `pyroshock ingest FOLDER`",
    "REPLACE": "a corrected recording comes with `pyroshock runs replace`",
    "UPDATE": "a corrected recording comes with `pyroshock runs replace`",
    "DELETE": "use `pyroshock campaigns delete` or `pyroshock runs discard`",
    "CREATE": "tables change with `pyroshock db upgrade`",
    "ALTER": "tables change with `pyroshock db upgrade`",
    "DROP": "use `pyroshock campaigns delete` for a campaign; tables change with `pyroshock db upgrade`",
    "ATTACH": "copy a store with `pyroshock db copy`",
    "VACUUM": "copy a store with `pyroshock db copy`",
    "PRAGMA": "`pyroshock query --tables` and `--schema TABLE` list what there is",
    "EXPLAIN": "open the database with its own program for that",
}


class QueryError(ValueError):
    """A statement that cannot be run, or was refused; the message says why and what to do."""


def refusal(word: str) -> QueryError:
    """The error for a statement, or a part of one, that is no question."""
    instead = _INSTEAD.get(word.upper(), "begin the statement with SELECT, WITH or VALUES")
    return QueryError(f"query reads and does not change the store, so {word.upper()} is refused; {instead}")


@dataclass(frozen=True)
class Statement:
    """SQL with named parameters (`:name`) and their values as text."""

    sql: str
    parameters: Mapping[str, str]

    def check(self) -> None:
        """Raises `QueryError` where the first word does not begin a question, or parameters do not fit."""
        words = _WORD.search(self._code())
        if words is None:
            raise QueryError('the statement is empty; for example: pyroshock query "select name from campaigns"')
        if words[0].upper() not in READING:
            raise refusal(words[0])
        named = self.names()
        missing = [name for name in named if name not in self.parameters]
        if missing:
            raise QueryError(f"no value for :{', :'.join(missing)}; give it with -p {missing[0]} VALUE")
        unused = [name for name in self.parameters if name not in named]
        if unused:
            names = ", ".join(f":{name}" for name in named) or "none"
            raise QueryError(f"-p {unused[0]}: the statement has no :{unused[0]}; its parameters: {names}")

    def names(self) -> list[str]:
        """Parameters in the order in which they first appear."""
        parameters = (token["parameter"] for token in _TOKENS.finditer(self.sql) if token["parameter"])
        return list(dict.fromkeys(parameters))

    def words(self) -> list[str]:
        """Names and keywords of the statement, without quoted text."""
        return _WORD.findall(self._code())

    def _code(self) -> str:
        return _TOKENS.sub(lambda token: token[0] if token["cast"] else " ", self.sql)

    def for_sqlite(self) -> tuple[str, dict[str, str | int | float]]:
        """SQL and values: a number where its shortest text is what was typed, so that "007" stays a name."""
        return self.sql, {name: _number_or_text(text) for name, text in self.parameters.items()}

    def for_postgresql(self) -> tuple[str, list[str]]:
        """SQL with $1, $2 and the values in this order, as text, whose type the server takes from where it stands."""
        names = self.names()

        def numbered(token: re.Match[str]) -> str:
            return f"${names.index(token['parameter']) + 1}" if token["parameter"] else token[0]

        return _TOKENS.sub(numbered, self.sql), [self.parameters[name] for name in names]


def _number_or_text(text: str) -> str | int | float:
    for kind in (int, float):
        try:
            number = kind(text)
        except ValueError:
            continue
        if repr(number) == text:
            return number
    return text
