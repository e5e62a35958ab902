"""Comments of the source that tell what a field, a column or a limit is: beside its name, or `#:`
above it."""

from __future__ import annotations

import ast
import inspect
import io
import sys
import tokenize
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from types import ModuleType

Named = ast.Assign | ast.AnnAssign
_ORDERS = ("noqa", "type:", "fmt:", "pragma")


@dataclass(frozen=True)
class Source:
    """A module's tree; by line its comments behind code (`beside`) and on lines of their own
    (`alone`)."""

    tree: ast.Module
    beside: dict[int, str]
    alone: dict[int, str]


@cache
def source_of(module: str) -> Source:
    """The source of an imported module, read once."""
    text = inspect.getsource(sys.modules[module])
    return Source(ast.parse(text), *_by_line(text))


def field_comments(kind: type) -> dict[str, str]:
    """Field of a class -> comment; of the class's own fields, and where they have one."""
    source = source_of(kind.__module__)
    body = next(
        node
        for node in source.tree.body
        if isinstance(node, ast.ClassDef) and node.name == kind.__name__
    )
    return _comments(source, body.body)


def constants(module: ModuleType) -> Iterator[tuple[str, object, str]]:
    """Name, value and comment of a module's public constants, in their order; one without a comment
    has ""."""
    source = source_of(module.__name__)
    comments = _comments(source, source.tree.body)
    for statement in source.tree.body:
        for name in _names(statement):
            if name.isupper() and not name.startswith("_"):
                yield name, getattr(module, name), comments.get(name, "")


def _comments(source: Source, body: Sequence[ast.stmt]) -> dict[str, str]:
    found: dict[str, str] = {}
    for statement in body:
        names = _names(statement)
        words = [source.beside[at] for at in (statement.end_lineno,) if at in source.beside]
        line = statement.lineno - 1
        while source.alone.get(line, "").startswith(":"):
            words.insert(0, source.alone[line])
            line -= 1
        text = " ".join(
            word.removeprefix(":").strip() for word in words if not word.startswith(_ORDERS)
        )
        if text:
            found |= dict.fromkeys(names, text.split("  # noqa")[0].split("# noqa")[0].strip())
    return found


def _by_line(source: str) -> tuple[dict[int, str], dict[int, str]]:
    """Comments behind code, and on lines of their own; the sign left out."""
    beside: dict[int, str] = {}
    alone: dict[int, str] = {}
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            (beside if token.line[: token.start[1]].strip() else alone)[token.start[0]] = (
                token.string[1:].strip()
            )
    return beside, alone


def _names(statement: ast.stmt) -> list[str]:
    if not isinstance(statement, Named):
        return []
    targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
    return [
        name.id for target in targets for name in ast.walk(target) if isinstance(name, ast.Name)
    ]
