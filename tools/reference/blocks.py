"""Docstrings and help texts as blocks: paragraphs, items of lists, and what is set as it stands."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass
from typing import Literal

Kind = Literal["text", "item", "code"]

_ITEM = re.compile(r"(?:-|\d+\.) +(?=\S)")
#: Lines of TOML, of which a docstring shows some without indenting them.
_SETTING = re.compile(r"\[?\[[\w.]+\]\]?$|\w+ = ")


@dataclass(frozen=True)
class Block:
    """Text and items are one line; code keeps its lines."""

    kind: Kind
    text: str


def blocks_of(doc: str | None) -> list[Block]:
    """The blocks of a docstring, its indentation taken off; click's mark of lines that stay (\\b)
    is left out."""
    found: list[Block] = []
    lines: list[str] = []
    kind: Kind = "text"

    def end() -> None:
        if lines:
            joined = (
                "\n".join(lines) if kind == "code" else " ".join(line.strip() for line in lines)
            )
            found.append(Block(kind, joined))
            lines.clear()

    for chunk in re.split(r"\n[ \t]*\n", inspect.cleandoc(doc or "").replace("\b", "")):
        kept = [line.rstrip() for line in chunk.split("\n") if line.strip()]
        if kept and all(_SETTING.match(line) for line in kept):
            kept = [f"    {line}" for line in kept]
        for line in kept:
            item = _ITEM.match(line)
            here: Kind = (
                "item"
                if item
                else "code"
                if _is_code(line, kind, lines)
                else kind
                if lines
                else "text"
            )
            if item or here != kind:
                end()
            kind = here
            lines.append(line[item.end() :] if item else line)
        end()
        kind = "text"
    return _joined(found)


def first_line(doc: str | None) -> str:
    """The first paragraph; "" of nothing."""
    return next((block.text for block in blocks_of(doc) if block.kind == "text"), "")


def _is_code(line: str, kind: Kind, lines: list[str]) -> bool:
    """Indented, and no second line of an item."""
    return line.startswith("  ") and not (kind == "item" and lines)


def _joined(found: list[Block]) -> list[Block]:
    """Code that an empty line parts is one block; the indentation that all of it has is taken
    off."""
    joined: list[Block] = []
    for block in found:
        if block.kind == "code" and joined and joined[-1].kind == "code":
            joined[-1] = Block("code", f"{joined[-1].text}\n\n{block.text}")
        else:
            joined.append(block)
    return [
        Block(b.kind, inspect.cleandoc("\n" + b.text)) if b.kind == "code" else b for b in joined
    ]
