"""Every reader of recordings: suffixes, the library below it, rules and limits."""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Sequence
from importlib import import_module
from types import ModuleType

from pyroshock.ingest import readers
from pyroshock.ingest.readers import READERS, base, contents, file_fields
from pyroshock.ingest.readers.base import Reader
from pyroshock.ingest.readers.csv import CsvReader
from pyroshock.ingest.readers.field_rules import FieldRule, Treatment, used
from pyroshock.ingest.readers.instruments import HEADER_FILE, INSTRUMENTS
from pyroshock.signals import units

from .comments import source_of
from .markdown import code, joined, prose, table
from .values import constants_table


def page() -> str:
    """A section a reader; then what holds for all of them."""
    return joined(
        _fields_of_all(), *(_section(reader) for reader in READERS), _limits(), _rates(), _units()
    )


def libraries(reader: Reader) -> list[str]:
    """The packages that its file and those beside it import for it, but for numpy where there is
    another."""
    own = import_module(type(reader).__module__)
    found = dict.fromkeys(name for module in (own, *_beside(own)) for name in _packages(module))
    return [name for name in found if name != "numpy"] or ["numpy"]


def _section(reader: Reader) -> str:
    kind = type(reader)
    facts = [
        f"- suffixes: {', '.join(map(code, reader.suffixes))}",
        f"- library: {', '.join(map(code, libraries(reader)))}",
        f"- class: {code(f'{kind.__module__}.{kind.__name__}')}",
    ]
    about = import_module(kind.__module__).__doc__
    return joined(
        f"## {reader.format}",
        prose(about),
        prose(kind.__doc__),
        "\n".join(facts),
        _fields(reader),
        _instruments(reader),
    )


def _fields_of_all() -> str:
    """Of every reader how many fields it uses, passes over and refuses; and what becomes of one
    that no table has."""
    rows = [
        (
            reader.format,
            *(str(sum(rule.treatment is kind for rule in reader.fields)) for kind in Treatment),
        )
        for reader in READERS
    ]
    return joined(
        "## Fields of a file",
        prose(file_fields.__doc__),
        table(["reader", *(kind.value for kind in Treatment)], rows),
    )


def _fields(reader: Reader) -> str:
    """What the format can say beside its samples, and what becomes of each statement."""
    if not reader.fields:
        return ""
    rows = [(code(rule.name), rule.treatment.value, rule.reason) for rule in reader.fields]
    return joined(
        f"Fields that the reader knows: {_counts(reader.fields)}.",
        table(["field", "treatment", "reason"], rows),
    )


def _instruments(reader: Reader) -> str:
    """The fields of each instrument that writes text."""
    if not isinstance(reader, CsvReader):
        return ""
    instruments = (*INSTRUMENTS, HEADER_FILE)
    rules = [rule for instrument in instruments for rule in instrument.rules]
    rows = []
    for instrument in instruments:
        heading = (
            [] if instrument.names else [used("heading of the columns", "names, units and time")]
        )
        for number, rule in enumerate((*heading, *instrument.rules)):
            name = "" if number else instrument.name
            rows.append(
                (name, code(rule.name.replace("\\", "")), rule.treatment.value, rule.reason)
            )
    return joined(
        "### Instruments",
        f"{len(instruments)} forms are known by their headers, with "
        f"{_counts(rules)} fields. A field that no rule "
        "names, and whose name announces time, scale, unit or gaps, refuses the file.",
        table(["instrument", "field", "treatment", "reason"], rows),
    )


def _counts(rules: Sequence[FieldRule]) -> str:
    return ", ".join(
        f"{sum(rule.treatment is kind for rule in rules)} {kind.value}" for kind in Treatment
    )


def _limits() -> str:
    crash = prose(readers.may_crash.__doc__)
    return joined(
        "## Limits of all readers", constants_table(base), prose(base.refuse_bomb.__doc__), crash
    )


def _rates() -> str:
    rows = [
        ("the sampling rate", _words(contents.RATE_NAMES), _words(contents.RATE_UNITS)),
        ("time", "`t`, `time`, `t_ms` and their like", _words(contents.TIME_UNITS)),
    ]
    return joined(
        "## Where the rate comes from", table(["what a file gives", "names", "units"], rows)
    )


def _units() -> str:
    rows = [(quantity, code(unit)) for quantity, unit in units.SI_UNITS.items()]
    spellings = [
        (code(ours) if ours else "(nothing)", code(units.unit_spelling(ours)))
        for ours in units._SPELLINGS
    ]
    return joined(
        "## Units",
        prose(units.__doc__),
        table(["quantity", "SI unit"], rows),
        "Written otherwise than pint has it:",
        table(["in the file or in campaign.toml", "read as"], spellings),
    )


def _words(names: object) -> str:
    assert isinstance(names, dict | frozenset)
    return ", ".join(code(name) for name in sorted(names) if name)


def _beside(module: ModuleType) -> Iterator[ModuleType]:
    for node in ast.walk(source_of(module.__name__).tree):
        if isinstance(node, ast.ImportFrom) and node.level == 1 and node.module:
            yield import_module(f".{node.module}", module.__package__)


def _packages(module: ModuleType) -> list[str]:
    """Packages of others that a file imports, wherever it does."""
    found = []
    for node in ast.walk(source_of(module.__name__).tree):
        if isinstance(node, ast.Import):
            found += [each.name for each in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0 and node.module:
            found.append(node.module)
    names = dict.fromkeys(name.split(".")[0] for name in found)
    return [name for name in names if name not in sys.stdlib_module_names]
