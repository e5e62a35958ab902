"""The statements of a block of commands, and inline ones in a page's prose."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

from .blocks import Block

_INLINE = re.compile(r"`((?:\.venv/bin/)?(?:pyroshock|make) [^`]+)`")


@dataclass(frozen=True)
class Statement:
    """A command as words; `program` without its folder, so that `.venv/bin/pyroshock` is `pyroshock`."""

    program: str
    words: tuple[str, ...]
    where: str
    line: str = ""  # as it stands there, for a shell

    @classmethod
    def of(cls, words: list[str], where: str, line: str = "") -> Statement:
        """Settings of the environment before a program are left out: nothing of ours is run with them."""
        while len(words) > 1 and re.fullmatch(r"[A-Z_]+=.*", words[0]):
            words = words[1:]
        return cls(Path(words[0]).name, tuple(words[1:]), where, line)

    def __str__(self) -> str:
        return f"{self.where}: {shlex.join([self.program, *self.words])}"


def statements_of(block: Block) -> list[Statement]:
    """Comments are left out, lines that end with a backslash go on in the next. Raises `ValueError` for open quotes."""
    found = []
    lines = enumerate(block.text.splitlines(), block.line)
    for number, line in lines:
        while line.endswith("\\"):
            line = line[:-1] + next(lines)[1]  # the next line belongs to this statement
        if words := shlex.split(line, comments=True):
            found.append(Statement.of(words, f"{block.page.name}:{number}", line))
    return found


def inline_statements(page: Path) -> list[Statement]:
    """Commands that stand between backquotes outside of the fenced blocks, without those that leave something open."""
    found, fenced = [], False
    for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
        if line.lstrip().startswith("```"):
            fenced = not fenced
        elif not fenced:
            texts = (text for text in _INLINE.findall(line) if not re.search(r"…|\.\.\.|\||COMMAND", text))
            found += [Statement.of(shlex.split(text), f"{page.name}:{number}") for text in texts]
    return found
