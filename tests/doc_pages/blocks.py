"""The fenced blocks of a page with the marks before them, the statements of a block, and those in a
page's prose."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

_FENCE = re.compile(r"^(?P<indent> *)(?P<ticks>`{3,})(?P<language>\S*)\s*$")
_MARK = re.compile(r"^ *<!-- (?P<kind>given|not run|exit code): (?P<text>.+?) -->\s*$")
#: Languages of blocks that hold commands, Python, and what commands print.
COMMANDS, PYTHON, PRINTED = "sh", "python", "text"


@dataclass(frozen=True)
class Block:
    """`text` without its fence, `line` the number of its first line; `printed` is what the page
    says comes of it."""

    page: Path
    line: int
    language: str
    text: str
    given: tuple[str, ...] = ()
    not_run: str | None = None
    exit_code: int = 0
    printed: str | None = None

    @property
    def runs(self) -> bool:
        return self.language in (COMMANDS, PYTHON)


def blocks_of(page: Path) -> list[Block]:
    """In their order. Raises `ValueError` for a fence that is not closed, and a mark that no block
    follows."""
    found: list[Block] = []
    for block in _fenced(page):
        if (
            block.language == PRINTED
            and found
            and found[-1].runs
            and found[-1].printed is None
            and not block.given
        ):
            found[-1] = replace(found[-1], printed=block.text)
        else:
            found.append(block)
    return found


def _fenced(page: Path) -> Iterator[Block]:
    marks: list[tuple[str, str]] = []
    opened: re.Match[str] | None = None
    inside: list[str] = []
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        fence = _FENCE.match(line)
        if opened is not None:
            if fence and fence["ticks"] == opened["ticks"] and not fence["language"]:
                yield _marked(
                    Block(page, number - len(inside), opened["language"], _text(opened, inside)),
                    marks,
                )
                opened, marks = None, []
            else:
                inside.append(line)
        elif fence:
            opened, inside = fence, []
        elif mark := _MARK.match(line):
            marks.append((mark["kind"], mark["text"]))
    if opened is not None:
        raise ValueError(f"{page.name}: a block is not closed")
    if marks:
        raise ValueError(f"{page.name}: no block follows the mark {marks[-1]}")


def _text(fence: re.Match[str], lines: list[str]) -> str:
    return "".join(f"{line.removeprefix(fence['indent'])}\n" for line in lines)


def _marked(block: Block, marks: list[tuple[str, str]]) -> Block:
    for kind, text in marks:
        if kind == "given":
            block = replace(
                block, given=(*block.given, *(each.strip() for each in text.split(";")))
            )
        elif kind == "not run":
            block = replace(block, not_run=text)
        else:
            block = replace(block, exit_code=int(text))
    return block


_INLINE = re.compile(r"`((?:\.venv/bin/)?(?:pyroshock|make) [^`]+)`")


@dataclass(frozen=True)
class Statement:
    """A command as words; `program` without its folder, so that `.venv/bin/pyroshock` is
    `pyroshock`."""

    program: str
    words: tuple[str, ...]
    where: str
    line: str = ""  # as it stands there, for a shell

    @classmethod
    def of(cls, words: list[str], where: str, line: str = "") -> Statement:
        """Settings of the environment before a program are left out: nothing of ours is run with
        them."""
        while len(words) > 1 and re.fullmatch(r"[A-Z_]+=.*", words[0]):
            words = words[1:]
        return cls(Path(words[0]).name, tuple(words[1:]), where, line)

    def __str__(self) -> str:
        return f"{self.where}: {shlex.join([self.program, *self.words])}"


def statements_of(block: Block) -> list[Statement]:
    """Comments are left out, lines that end with a backslash go on in the next. Raises `ValueError`
    for open quotes."""
    statements = []
    lines = enumerate(block.text.splitlines(), block.line)
    for number, line in lines:
        while line.endswith("\\"):
            line = line[:-1] + next(lines)[1]  # the next line belongs to this statement
        if words := shlex.split(line, comments=True):
            statements.append(Statement.of(words, f"{block.page.name}:{number}", line))
    return statements


def inline_statements(page: Path) -> list[Statement]:
    """Commands that stand between backquotes outside of the fenced blocks, without those that leave
    something open."""
    statements, fenced = [], False
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif not fenced:
            texts = (
                text
                for text in _INLINE.findall(line)
                if not re.search(r"…|\.\.\.|\||COMMAND", text)
            )
            statements += [
                Statement.of(shlex.split(text), f"{page.name}:{number}") for text in texts
            ]
    return statements
