"""What docstrings and comments name exists: files, members of modules, and identifiers."""

from __future__ import annotations

import builtins
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
#: Folders and files of the root whose docstrings and comments are read.
READ = (
    "app", "benchmarks", "dataset", "diagnosis", "doe", "examples", "files", "ingest", "parallel",
    "schema", "signals", "tools", "training", "twin", "validation", "virtualbench",
    "__init__.py", "__main__.py", "array_types.py", "plugins.py",
)  # fmt: skip
#: Names of other software, and of examples.
OTHERS = frozenset({
    "A1x_m_s2", "CellExecutionError", "Coregionalize", "Data1_time_AI_1", "IndexKernel",
    "MATLAB_int_decode", "NAME_1", "NAME_2", "NoResultFound", "RBFSampler", "_s2", "accel_g",
    "data_k", "evr", "field", "fitrensemble", "fitrkernel", "fitrnet", "fitrsvm", "lhsdesign",
    "mm2", "name_2", "perceptron", "plsregress", "srs_10hz_m_s2", "tfestimate",
    "Test_001.lvm", "Test_032.lvm", "a/b.py", "copy.py", "predicted.csv",
})  # fmt: skip
_STRING = re.compile(
    r'''(?P<doc>(?<=\n)[ ]*r?"""(?:\\.|[^\\])*?"""(?=\n)|\Ar?"""(?:\\.|[^\\])*?""")'''
    r'''|"""(?:\\.|[^\\])*?"""|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*\''''
    r"""|(?P<comment>\#[^\n]*(?:\n[ ]*\#[^\n]*)*)""",
    re.DOTALL,
)
_FILE = re.compile(r"(?<![\w./<~*-])(?:[\w-]+/)*[\w-]+\.(?:md|py|toml|csv|jsonl(?:\.gz)?|sh)\b")
_SPAN = re.compile(r"(?<!`)`([^`]+)`(?!`)")
_NAME = re.compile(r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*(?=$|\(\)$)")
_WORD = re.compile(r"[A-Za-z_]\w*")
_PAIR = re.compile(r"(?=\b([A-Za-z_]\w*)\.([A-Za-z_]\w*))")


@cache
def sources() -> tuple[Path, ...]:
    listed = (path for name in READ for path in (ROOT / name).rglob("*.py"))
    return (*listed, *(ROOT / name for name in READ if name.endswith(".py")))


@cache
def parted(path: Path) -> tuple[str, tuple[tuple[int, str], ...]]:
    """The code of a file, and its docstrings and comments with their lines."""
    text = path.read_text(encoding="utf-8")
    prose, code, end = [], [], 0
    for match in _STRING.finditer(text):
        if match.lastgroup is not None:
            words = re.sub(r"\n *#:? ?", "\n", match[0]).strip(' #:r"')
            prose.append((text.count("\n", 0, match.start()) + 1, words))
            code.append(text[end : match.start()])
            end = match.end()
    return "".join((*code, text[end:])), tuple(prose)


@cache
def known() -> tuple[frozenset[str], frozenset[tuple[str, str]], dict[str, set[str]]]:
    """Words of the code, pairs with a dot between them, and the words of the modules of a name."""
    texts = {path: parted(path)[0] for path in sources()}
    others = (*(ROOT / "tests").rglob("*.py"), *(ROOT / "app").rglob("*.html"))
    texts |= {
        path: path.read_text(encoding="utf-8")
        for path in others
        if path.name != Path(__file__).name
    }
    members: dict[str, set[str]] = {}
    for path in sources():
        is_package = path.name == "__init__.py"
        of_name = members.setdefault(path.parent.name if is_package else path.stem, set())
        of_name |= {entry.stem for entry in path.parent.iterdir()} if is_package else set()
        of_name |= set(_WORD.findall(texts[path]))
    words = {word for text in texts.values() for word in _WORD.findall(text)}
    pairs = {pair for text in texts.values() for pair in _PAIR.findall(text)}
    names = {part for path in sources() for part in (path.stem, *path.relative_to(ROOT).parts)}
    return frozenset(words | names | OTHERS | set(dir(builtins))), frozenset(pairs), members


def dead_files(path: Path, text: str) -> Iterator[str]:
    """Paths that lead nowhere, seen from the root, and from the folder of the file and above."""
    _, pairs, _ = known()
    folders = [folder for folder in path.parents if folder.is_relative_to(ROOT)]
    for name in _FILE.findall(text):
        is_of_a_folder = "/" not in name and tuple(name.split(".")) in pairs
        if name in OTHERS or is_of_a_folder:
            continue
        if not any((folder / name).exists() for folder in folders):
            yield name


def dead_names(text: str) -> Iterator[str]:
    """Names between backticks that nothing has."""
    words, pairs, members = known()
    for span in _SPAN.findall(text):
        if (match := _NAME.match(span.strip())) and not _FILE.match(span.strip()):
            parts = match[0].split(".")
            is_dead = any(part not in words for part in parts)
            if len(parts) > 1 and tuple(parts[-2:]) not in pairs:
                is_dead |= parts[-1] not in members.get(parts[-2], words)
            if is_dead and not OTHERS & {match[0], parts[-1]}:
                yield match[0]


@pytest.mark.parametrize("folder", READ)
def test_files_and_names_of_docstrings_and_comments_exist(folder: str) -> None:
    wrong = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for path in sources()
        if path.relative_to(ROOT).parts[0] == folder
        for line, text in parted(path)[1]
        for name in (*dead_files(path, text), *dead_names(text))
    ]
    assert wrong == []


@pytest.mark.parametrize("text", [
    "As in `docs/no-such-page.md`.", "See no_room/no_module.py.", "`no_such_name()` does it.",
    "As `session.no_such_member` has it.", "`spectrum.shock_response_spectre`",
])  # fmt: skip
def test_a_reference_to_nothing_is_found(text: str) -> None:
    assert [*dead_files(ROOT / "schema" / "session.py", text), *dead_names(text)] != []
