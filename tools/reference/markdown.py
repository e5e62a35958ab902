"""Markdown that shows what a text says: nothing but its code spans is taken for markup."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from .blocks import blocks_of

_SPAN = re.compile(r"(`[^`]+`)")
_SIGNS = re.compile(r"([\\*_<>\[\]#~^$&|`])")


def escaped(text: str) -> str:
    """`text` as it stands, its code spans kept."""
    parts = _SPAN.split(text)
    return "".join(part if i % 2 else _SIGNS.sub(r"\\\1", part) for i, part in enumerate(parts))


def code(text: str) -> str:
    """A code span."""
    return f"`` {text} ``" if "`" in text else f"`{text}`"


def prose(doc: str | None) -> str:
    """A docstring: paragraphs, lists, and code fenced."""
    made = []
    for block in blocks_of(doc):
        if block.kind == "code":
            made.append(f"```\n{block.text}\n```")
        elif block.kind == "item":
            made.append(f"- {paragraph(block.text)}")
        else:
            made.append(paragraph(block.text))
    return "\n\n".join(made)


def paragraph(text: str) -> str:
    """One paragraph: what would begin a list or a heading does not."""
    return re.sub(
        r"^(\d+)([.)])(?= )|^([-+=:])",
        lambda m: f"{m[1]}\\{m[2]}" if m[1] else f"\\{m[3]}",
        escaped(text),
    )


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of cells that are Markdown already; "" where there is no row."""
    lines = [_row(row) for row in rows]
    return "\n".join([_row(header), _row(["---"] * len(header)), *lines]) if lines else ""


def joined(*parts: str) -> str:
    """Blocks with an empty line between them; empty ones are left out."""
    return "\n\n".join(part for part in parts if part)


def _row(cells: Sequence[str]) -> str:
    # A sign that parts cells does so within code spans, too; escaped text has its own escaped
    # already.
    return (
        "| "
        + " | ".join(re.sub(r"(?<!\\)\|", r"\|", " ".join(cell.split())) for cell in cells)
        + " |"
    )
