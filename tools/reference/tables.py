"""Every table and column of the store, with its rules and the comments of the models."""

from __future__ import annotations

from pyroshock.schema.base import Base
from pyroshock.schema.tables import metadata
from sqlalchemy import CheckConstraint, Column, Table, UniqueConstraint
from sqlalchemy.dialects import postgresql, sqlite

from .comments import field_comments
from .markdown import code, escaped, joined, prose, table


def models() -> dict[str, type[Base]]:
    """Table -> the class that is its row, in the order of the tables' names."""
    found = {mapper.class_.__tablename__: mapper.class_ for mapper in Base.registry.mappers}
    return {name: found[name] for name in sorted(metadata.tables)}


def page() -> str:
    """A section a table: columns, rules, indices."""
    return joined(*(_section(metadata.tables[name], kind) for name, kind in models().items()))


def _section(stored: Table, kind: type[Base]) -> str:
    comments: dict[str, str] = {}
    for each in reversed(kind.__mro__):
        if each.__module__.startswith("pyroshock") and each is not Base:
            comments |= field_comments(each)
    rows = [_column(column, comments.get(column.name, "")) for column in stored.columns]
    where = f"Row: {code(f'{kind.__module__}.{kind.__name__}')}."
    columns = table(["column", "type", "empty", "key", "what it is"], rows)
    return joined(
        f"## {stored.name}", prose(kind.__doc__), where, columns, _rules(stored), _indices(stored)
    )


def _column(column: Column[object], comment: str) -> tuple[str, str, str, str, str]:
    keys = ["primary"] if column.primary_key else []
    keys += [f"→ {code(each.target_fullname)}" for each in column.foreign_keys]
    keys += ["unique"] if column.unique else []
    return (
        code(column.name),
        _type(column),
        "yes" if column.nullable else "no",
        ", ".join(keys),
        escaped(comment),
    )


def _type(column: Column[object]) -> str:
    """As SQLite and PostgreSQL call it; once where they agree."""
    # SQLAlchemy's own
    engines = (sqlite.dialect(), postgresql.dialect())  # type: ignore[no-untyped-call]
    return " / ".join(dict.fromkeys(column.type.compile(dialect=engine) for engine in engines))


def _rules(stored: Table) -> str:
    checks = [each for each in stored.constraints if isinstance(each, CheckConstraint)]
    uniques = [each for each in stored.constraints if isinstance(each, UniqueConstraint)]
    lines = [
        f"- unique: {_listed(each)}"
        for each in sorted(uniques, key=_listed)
        if len(each.columns) > 1
    ]
    lines += [
        f"- {code(str(each.sqltext))}" for each in sorted(checks, key=lambda one: str(one.name))
    ]
    return joined("Rules:", "\n".join(lines)) if lines else ""


def _indices(stored: Table) -> str:
    found = sorted(stored.indexes, key=lambda one: str(one.name))
    lines = [
        f"- {'unique: ' if each.unique else ''}{', '.join(code(c.name) for c in each.columns)}"
        for each in found
    ]
    return joined("Indices:", "\n".join(lines)) if lines else ""


def _listed(constraint: UniqueConstraint) -> str:
    return ", ".join(code(column.name) for column in constraint.columns)
