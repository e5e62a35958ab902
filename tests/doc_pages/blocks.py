"""The fenced blocks of a page, with the marks before them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

_FENCE = re.compile(r"^(?P<indent> *)(?P<ticks>`{3,})(?P<language>\S*)\s*$")
_MARK = re.compile(r"^ *<!-- (?P<kind>given|not run|exit code): (?P<text>.+?) -->\s*$")
#: Languages of blocks that hold commands, Python, and what commands print.
COMMANDS, PYTHON, PRINTED = "sh", "python", "text"


@dataclass(frozen=True)
class Block:
    """`text` without its fence, `line` the number of its first line; `printed` is what the page says comes of it."""

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
    """In their order. Raises `ValueError` for a fence that is not closed, and a mark that no block follows."""
    found: list[Block] = []
    for block in _fenced(page):
        if block.language == PRINTED and found and found[-1].runs and found[-1].printed is None and not block.given:
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
                yield _marked(Block(page, number - len(inside), opened["language"], _text(opened, inside)), marks)
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
            block = replace(block, given=(*block.given, *(each.strip() for each in text.split(";"))))
        elif kind == "not run":
            block = replace(block, not_run=text)
        else:
            block = replace(block, exit_code=int(text))
    return block
