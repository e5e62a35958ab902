"""The reference is whole: whatever the code has stands in it, with what its own words say of it."""

from __future__ import annotations

import re
from functools import cache

import click
import pytest
from pyroshock.app.operations.catalogue import OPERATIONS, operations
from pyroshock.dataset import predictors
from pyroshock.diagnosis.observable_families import family_of
from pyroshock.diagnosis.observables.contact.features import OBSERVABLES
from pyroshock.doe.designs.methods import METHODS
from pyroshock.ingest.readers import READERS
from pyroshock.schema.tables import metadata
from pyroshock.signals.checks import CHECKS, SPECTRUM_CHECKS
from pyroshock.training.models.catalogue import MODEL_SPECS
from pyroshock.training.models.serialization import KINDS
from pyroshock.twin.effects import catalogue

from tools.reference import api, checks, commands, designs, models, readers, tables
from tools.reference.blocks import Block, blocks_of, first_line
from tools.reference.comments import constants, field_comments
from tools.reference.markdown import code, escaped, paragraph, prose, table
from tools.reference.rooms import ROOMS
from tools.reference.subjects import SUBJECTS, filled


@cache
def page(subject: str) -> str:
    return SUBJECTS[subject]()


def section(subject: str, title: str) -> str:
    """The part of a page under a heading of any level."""
    found = re.search(
        rf"^#+ {re.escape(title)}$(.*?)(?=^#+ |\Z)", page(subject), re.MULTILINE | re.DOTALL
    )
    assert found, title
    return found[1]


# --- every subject ---
ALL = [(context.command_path, command) for context, command in commands.commands()]


@pytest.mark.parametrize(("path", "command"), ALL[1:], ids=[path for path, _ in ALL[1:]])
def test_a_command_has_its_words_and_options(path: str, command: click.Command) -> None:
    words = section("commands", path)
    assert escaped(first_line(command.help)) in words
    for option in commands.options_of(command):
        assert option.help, f"{path} {option.opts[-1]} has no help"
        assert f"{option.opts[-1]}" in words


def test_defaults_comments_and_limits_are_told() -> None:
    words = section("commands", "pyroshock plan lhs")
    assert re.search(r"^\| `--repetitions [^|]*\| `10` \|", words, re.MULTILINE)
    assert re.search(r"^\| `--runs [^|]*\| `105` \|", words, re.MULTILINE)
    assert (
        re.search(r"^\| `--seed [^|]*\| drawn and reported \|", words, re.MULTILINE)
        and "`PYROSHOCK_DB`" in words
    )
    assert (
        "| `start_s` | DOUBLE / DOUBLE PRECISION | no |  | first instant of contact, on the"
        in page("tables")
    )
    assert "`status = 'stored' OR reason IS NOT NULL`" in section("tables", "recordings")
    assert "| `written_by_id` | INTEGER | no | → `provenance.id` |" in section("tables", "shots")
    words = section("checks", "double-hit")
    assert re.search(
        r"^\| `MIN_SHARE` \| `0\.05` \| A second peak counts from this share", words, re.MULTILINE
    )


@pytest.mark.parametrize("name", sorted(metadata.tables))
def test_a_table_has_its_columns_and_rules(name: str) -> None:
    words = section("tables", name)
    assert escaped(first_line(tables.models()[name].__doc__)) in words
    stored = metadata.tables[name]
    assert re.findall(r"^\| `(\w+)` \|", words, re.MULTILINE) == [
        column.name for column in stored.columns
    ]
    assert words.count(" no |") >= sum(not column.nullable for column in stored.columns)


@pytest.mark.parametrize("kind", list(catalogue().values()), ids=list(catalogue()))
def test_an_effect_has_law_source_and_parameters(kind) -> None:
    words = section("effects", kind.id)
    assert code(kind.law) in words and escaped(kind.source) in words and kind.__doc__
    assert escaped(first_line(kind.__doc__)) in words
    assert re.findall(r"^\| `(\w+)` \|", words, re.MULTILINE) == [
        item.name for item in kind.parameters()
    ]


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.format)
def test_a_reader_has_suffixes_and_library(reader) -> None:
    words = section("readers", reader.format)
    assert escaped(first_line(type(reader).__doc__)) in words
    for suffix in reader.suffixes:
        assert f"`{suffix}`" in words
    assert readers.libraries(reader)


def test_every_operation_and_every_reason_why_it_is_not_offered_is_in_the_reference() -> None:
    page = SUBJECTS["operations"]()
    assert all(f"| {name} |" in page for name in OPERATIONS)
    reasons = {reason for declared in operations() for reason in declared.absent.values()}
    assert all(escaped(reason) in page for reason in reasons)


def test_libraries_and_imported_names_are_in_the_reference_and_unknown_subjects_refused() -> None:
    found = {reader.format: readers.libraries(reader) for reader in READERS}
    assert (
        found["mat"] == ["scipy", "h5py"]
        and found["npz"] == ["numpy"]
        and found["tdms"] == ["nptdms"]
    )
    assert "autofunction:: pyroshock.ingest.load.ingest_folder" in page("api ingest")
    assert "autofunction:: pyroshock.diagnosis.diagnose.diagnose" in page("api diagnosis")
    with pytest.raises(
        LookupError, match="no subject 'weather' of the reference; there are: commands, operations"
    ):
        filled("# A page\n\n<!-- generated: weather -->\n")


@pytest.mark.parametrize(
    "check", [*CHECKS, *SPECTRUM_CHECKS], ids=lambda check: check.__module__.split(".", 1)[1]
)
def test_a_check_has_its_words(check) -> None:
    assert escaped(first_line(check.__doc__)) in section("checks", checks.name_of(check))


def test_methods_of_design_have_their_options_and_are_those_of_the_folder() -> None:
    for name, method in METHODS.items():
        words = section("designs", name)
        assert escaped(method.help) in words
        for option in method.options:
            assert f"| `{option.name}` |" in words
    found = {function.__name__ for function in designs.functions()}
    assert {
        "augment",
        "balance_levels",
        "read_table",
        "factorial",
        "subset",
        "plackett_burman",
        "optimal",
    } < found
    for function in designs.functions():
        words = section("designs", f"{function.__module__.rpartition('.')[2]}.{function.__name__}")
        assert escaped(first_line(function.__doc__)) in words


def test_models_kinds_and_observables_are_all_told() -> None:
    names = re.findall(r"^\| `([\w-]+)` \| \[", section("models", "Models by name"), re.MULTILINE)
    assert names == list(MODEL_SPECS)
    for kind in KINDS:
        assert escaped(first_line(models.class_of(kind).__doc__)) in section("models", kind)
    assert "[coregional](#coregional)" in page("models")
    for observable in OBSERVABLES:
        row = (
            f"| `{observable.name}` | force | {family_of(observable)} | "
            f"{observable.unit} | {observable.tolerance:g} |"
        )
        assert row in page("observables")
    assert "| `ln_velocity` | velocity |" in page("observables")
    assert (
        "| `acceleration_1 spectrum at 1000 Hz` | acceleration\\_1 | spectrum | dB | 0.5 | 0.15 |"
        in page("observables")
    )


@pytest.mark.parametrize("room", ROOMS)
def test_names_of_a_room_have_docstrings_and_stand_in_it(room: str) -> None:
    for module in api.modules(room):
        assert module.__doc__, module.__name__
        words = section(f"api {room}", module.__name__)
        named = re.findall(
            rf"^\.\. auto(?:class|function):: {re.escape(module.__name__)}\.(\w+)$",
            words,
            re.MULTILINE,
        )
        own = api.members(module)
        assert named == [thing.__name__ for thing in own]
        assert [thing.__qualname__ for thing in own if not thing.__doc__] == []


# --- text ---
def test_blocks_and_signs_of_markdown_show_as_they_are() -> None:
    doc = """A first line
    that goes on.

    \b
    Example:
        pyroshock demo

        pyroshock plan
    - one
      and more
    - two

    name = "hammer"
    """
    assert blocks_of(doc) == [
        Block("text", "A first line that goes on."),
        Block("text", "Example:"),
        Block("code", "pyroshock demo\n\npyroshock plan"),
        Block("item", "one and more"),
        Block("item", "two"),
        Block("code", 'name = "hammer"'),
    ]
    assert escaped("a*b `c*d` e_f <g>") == r"a\*b `c*d` e\_f \<g\>"
    assert (
        paragraph("1. not a list") == r"1\. not a list" and paragraph("- neither") == r"\- neither"
    )
    assert table(["a"], [["x|y `p|q`"]]).splitlines()[-1] == r"| x\|y `p\|q` |"
    assert prose("Text:\n\n    code |x|\n\nMore.") == "Text:\n\n```\ncode |x|\n```\n\nMore."


class Told:
    """With comments of every form."""

    beside: int  # in words
    #: Above, in
    #: two lines.
    above: str
    neither: float = 0.0
    both: int = 0  #: m, of the plate


def test_comments_of_fields_and_constants_are_found() -> None:
    assert field_comments(Told) == {
        "beside": "in words",
        "above": "Above, in two lines.",
        "both": "m, of the plate",
    }
    assert ("SHIPPED", ("hammer", "gun"), "") in list(constants(predictors))
