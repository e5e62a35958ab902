"""The pages say what is there: commands, tables, questions, terms, equations, tables of the thesis;
examples run."""

from __future__ import annotations

import importlib
import re
import shlex
from pathlib import Path

import pytest
from doc_pages.running import place_in
from pyroshock.app.operations.command_words import COMMANDS
from pyroshock.benchmarks.scale import MARK, QUESTIONS
from pyroshock.schema.impacts import Impact
from pyroshock.schema.tables import metadata
from sqlalchemy import func, select
from support.records.campaigns import hammer_campaign
from support.stores.hammer_stores import full_campaign
from support.stores.large_store import StoreSize, fill, sample_of
from support.stores.registries import fresh_registry
from support.stores.stores import ingested, opened

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"


def page(name: str) -> str:
    return (DOCS / name).read_text(encoding="utf-8")


def test_every_command_and_every_table_has_a_row():
    rows = re.findall(r"^\| `([a-z-]+)` \|", page("reference/command-overview.md"), re.MULTILINE)
    assert rows == list(COMMANDS)
    tables = page("reference/store.md").split("\n## ")[0]
    rows = [line.split("|")[1] for line in tables.splitlines() if line.startswith("| `")]
    assert {name for row in rows for name in re.findall(r"`(\w+)`", row)} == set(metadata.tables)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_examples_of_the_commands_run(tmp_path, request):
    examples = re.findall(
        r"\| `pyroshock ([^`]+)` \|$", page("reference/command-overview.md"), re.MULTILINE
    )
    assert len(examples) == len(COMMANDS)
    with place_in(tmp_path, request) as place:
        full_campaign(tmp_path / "small", "small")
        fresh_registry(tmp_path)
        place.pyroshock("ingest", "examples/modal-hammer-hit", "small", "--db", "sqlite:///lab.db")
        for example in examples:
            code, said = place.invoked(shlex.split(example))
            # The shipped specification is softer than what the shipped bench gives at its least
            # pressure.
            assert code == (1 if example.startswith("tune") else 0), f"pyroshock {example}: {said}"


# --- docs/measurements/scale.md: every question that `make bench-scale` asks ---
PAGE = Path(__file__).resolve().parents[2] / "docs" / "measurements" / "scale.md"


@pytest.fixture(scope="module")
def large_store(tmp_path_factory):
    """Four small campaigns in the shape of the large ones, and what is in them."""
    folder = tmp_path_factory.mktemp("large")
    real, url = f"sqlite:///{folder}/real.db", f"sqlite:///{folder}/large.db"
    ingested(real, hammer_campaign(folder / "real", 1, 2))
    with opened(real) as store:
        size = StoreSize(4_000, 1_000, own_radii=True, sample=sample_of(store), series_every=20)
    fill(url, size)
    with opened(url) as store, store.reading() as session:
        yield session, size


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda q: q.name)
def test_questions_are_answered(large_store, question):
    session, size = large_store
    question.ask(session, size)
    assert session.scalar(select(func.count()).select_from(Impact)) == size.impacts


def test_tables_and_effects_are_those_of_the_exchange_folder(
    thesis_tables: Path, shared: Path, effect_ids: list[str]
):
    ours = {path.name: path.read_text(encoding="utf-8") for path in thesis_tables.glob("*.csv")}
    assert ours == {
        path.name: path.read_text(encoding="utf-8") for path in (shared / "reference").glob("*.csv")
    }
    text = (shared / "effects.md").read_text(encoding="utf-8")
    assert effect_ids == re.findall(r"^\| `([a-z_.]+)` \|", text, re.MULTILINE)


# --- the glossary: each term once, and every name in it leads to code ---
GLOSSARY = Path(__file__).resolve().parents[2] / "docs" / "reference" / "glossary.md"
COLUMNS = ["term", "meaning", "symbol", "unit", "in the code"]


def table_lines() -> list[list[str]]:
    """Cells of every line of the glossary's tables, headings included."""
    lines = GLOSSARY.read_text(encoding="utf-8").splitlines()
    return [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in lines
        if line.startswith("|") and not line.startswith("| ---")
    ]


ROWS = [cells for cells in table_lines() if cells[0] != "term"]


def resolve(name: str) -> object:
    """The module, function, class or attribute with this dotted name. Raises `AttributeError` where
    there is none."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        module_name = ".".join(parts[:length])
        try:
            target: object = importlib.import_module(module_name)
        except ModuleNotFoundError as error:
            if error.name is None or not f"{module_name}.".startswith(f"{error.name}."):
                raise  # the module is there; what it imports is not
            continue
        for part in parts[length:]:
            target = (
                getattr(target, part) if hasattr(target, part) else _annotated(target, part, name)
            )
        return target
    raise AttributeError(name)


def _annotated(owner: object, field: str, name: str) -> object:
    """A field of a class that has an annotation and no default."""
    if field not in getattr(owner, "__annotations__", {}):
        raise AttributeError(name)
    return owner.__annotations__[field]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_name_of_a_term_leads_to_code(row: list[str]) -> None:
    names = re.findall(r"`([\w.]+)`", row[-1])
    assert names
    for name in names:
        assert name.split(".")[0] == "pyroshock" and not any(
            part.startswith("_") for part in name.split(".")
        )
        resolve(name)


@pytest.mark.parametrize(
    "name", ["pyroshock.no_such_module", "pyroshock.twin.chain.Twin.no_such_method"]
)
def test_wrong_name_is_noticed(name: str) -> None:
    with pytest.raises(AttributeError):
        resolve(name)


def test_every_term_stands_once_with_all_columns() -> None:
    terms = [row[0].lower() for row in ROWS]
    assert len(terms) >= 60 and sorted(terms) == sorted(set(terms))
    assert [cells for cells in table_lines() if cells[0] == "term"] == [COLUMNS] * 6
    assert [row[0] for row in ROWS if len(row) != len(COLUMNS) or not all(row)] == []


# --- every equation of the thesis has its page and its code ---
#: How many numbered equations each chapter has.
CHAPTERS = {1: 28, 2: 18, 3: 1, 4: 9, 5: 7}
EQUATIONS = [
    f"{chapter}.{number}" for chapter, last in CHAPTERS.items() for number in range(1, last + 1)
]
ROOMS = ("dataset", "diagnosis", "doe", "ingest", "training", "twin")
_CITED = re.compile(r"[Tt]hesis,? eq\. [\d., to-]+")


def equation_rows() -> list[tuple[set[str], list[str], list[str]]]:
    """Of the table in deviations.md: equations, pages, files."""
    text = (
        (DOCS / "explanation" / "deviations.md")
        .read_text(encoding="utf-8")
        .split("## Where each equation stands")[1]
    )
    cells = [line.strip("|").split("|") for line in text.splitlines() if re.match(r"\| \d", line)]
    return [
        (
            numbers(first),
            re.findall(r"\]\(([\w./-]+)(?:#[\w.-]*)?\)", pages),
            re.findall(r"`([\w/.]+)`", files),
        )
        for first, pages, files in cells
    ]


def numbers(text: str) -> set[str]:
    """`1.4 to 1.8` and `2.7, 2.8` as each of them."""
    decimals = set()
    for first, last in re.findall(r"(\d\.\d+)(?: (?:to|-) (\d\.\d+))?", text):
        chapter, begin = first.split(".")
        end = int(last.split(".")[1]) if last else int(begin)
        decimals |= {f"{chapter}.{number}" for number in range(int(begin), end + 1)}
    return decimals


def test_every_equation_and_every_question_has_a_row() -> None:
    assert set().union(*(equations for equations, _, _ in equation_rows())) == set(EQUATIONS)
    measured = PAGE.read_text(encoding="utf-8").split(MARK)[1]
    assert [name for name in (q.name for q in QUESTIONS) if f"| {name} |" not in measured] == []


@pytest.mark.parametrize(
    ("equations", "pages", "files"), equation_rows(), ids=lambda value: " ".join(sorted(value))
)
def test_row_leads_to_pages_that_have_it_and_code_that_names_some(equations, pages, files) -> None:
    shown = set().union(*(mentioned(DOCS / "explanation" / page) for page in pages))
    assert sorted(equations - shown) == [] and all((ROOT / file).is_file() for file in files)
    assert any(equations & mentioned(ROOT / file) for file in files)


@pytest.mark.parametrize("room", ROOMS)
def test_code_cites_equations_that_the_thesis_has(room: str) -> None:
    for file in sorted((ROOT / room).rglob("*.py")):
        cited = numbers(" ".join(_CITED.findall(file.read_text(encoding="utf-8"))))
        assert cited <= set(EQUATIONS), file


def mentioned(file: Path) -> set[str]:
    """Equations that a file names: in a cell of a table, or after `eq.`."""
    text = file.read_text(encoding="utf-8")
    return numbers(" ".join(re.findall(r"(?:[Ee]qs?\.|[Ee]quation|\|)[^|\n]*", text)))
