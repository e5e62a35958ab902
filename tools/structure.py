"""How large the product is, how it is divided, and how it names things: a table for docs and for a
change's record.

    python -m tools.structure                # this tree
    python -m tools.structure 7d11b52        # another commit, beside this tree
    python -m tools.structure --lint         # fails on a name that says nothing, or a class name
                                             # given twice

The product is every Python file of the rooms that pyproject.toml installs, without tests,
benchmarks and tools.
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import statistics
import subprocess
import sys
import tarfile
import tempfile
import tokenize
import tomllib
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = "pyroshock"
#: Local names that say nothing about what they hold.
BANNED = frozenset(
    {"found", "each", "told", "left", "one", "mine", "known", "said", "asked", "way"}
)
#: Longer lines than this are counted.
WIDTH = 100
#: Folders of docs/ without prose of the present: pictures, the built site, the record of decisions.
GENERATED = ("images", "_build", "decisions")
GENERATED_MARK = re.compile(
    r"<!-- generated|^`(make bench|python -m [a-z.]+)` wrote this "
    r"page|`python -m benchmarks --full` writes the page",
    re.MULTILINE,
)


@dataclass(frozen=True)
class SourceFile:
    """One Python file of the product."""

    path: Path
    text: str

    @cached_property
    def tree(self) -> ast.Module:
        """Raises `SyntaxError` where Python cannot read the file."""
        return ast.parse(self.text, str(self.path))

    @property
    def lines(self) -> int:
        return self.text.count("\n")


def product_files(root: Path) -> list[SourceFile]:
    """Sorted by path."""
    rooms = _rooms(root)
    paths = sorted(path for room in rooms for path in (root / room).rglob("*.py"))
    paths += [path for path in (root / "__init__.py", root / "__main__.py") if path.exists()]
    return [SourceFile(path.relative_to(root), path.read_text(encoding="utf-8")) for path in paths]


def _rooms(root: Path) -> list[str]:
    packages = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["setuptools"][
        "packages"
    ]
    names = {name.split(".")[1] for name in packages if "." in name}
    return sorted(names - {"examples", "tests", "tools", "benchmarks"})


def code_lines(text: str) -> int:
    """Lines that hold more than a comment or a docstring."""
    tree = ast.parse(text)
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, documented) and ast.get_docstring(node, clean=False) is not None:
            first = node.body[0]
            docstrings |= set(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    silent = (
        tokenize.COMMENT,
        tokenize.NL,
        tokenize.NEWLINE,
        tokenize.INDENT,
        tokenize.DEDENT,
        tokenize.ENDMARKER,
    )
    lines: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in silent:
            lines |= set(range(token.start[0], token.end[0] + 1))
    return len(lines - docstrings)


def function_lengths(tree: ast.Module) -> list[int]:
    """Lines of every function, decorators left out."""
    return [
        (node.end_lineno or node.lineno) - node.lineno + 1
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]


def assigned_locals(tree: ast.Module) -> Iterator[ast.Name]:
    """Every name that a function, lambda or comprehension assigns: targets, loop variables, `with
    ... as`."""
    scopes = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)
    comprehensions = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)

    def walk(node: ast.AST, inside: bool) -> Iterator[ast.Name]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, ast.Name) and isinstance(child.ctx, ast.Store) and inside:
                yield child
            yield from walk(child, inside or isinstance(child, scopes + comprehensions))

    yield from walk(tree, False)


def parameters(tree: ast.Module) -> Iterator[ast.arg]:
    """Every parameter of a function; those of a lambda live for one expression and are left out."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield from (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)


def duplicate_classes(files: Iterable[SourceFile]) -> dict[str, list[str]]:
    """Names of classes that are defined more than once, and where; a class may have the name of one
    of its bases."""
    places: dict[str, list[tuple[Path, ast.ClassDef]]] = defaultdict(list)
    for file in files:
        for node in ast.walk(file.tree):
            if isinstance(node, ast.ClassDef):
                places[node.name].append((file.path, node))
    duplicates = {}
    for name, definitions in places.items():
        own = [path for path, node in definitions if not _has_base(node, name)]
        if len(own) > 1:
            duplicates[name] = sorted(map(str, own))
    return duplicates


def _has_base(node: ast.ClassDef, name: str) -> bool:
    return any(isinstance(base, ast.Attribute) and base.attr == name for base in node.bases)


def sibling_cycles(files: Sequence[SourceFile]) -> list[list[str]]:
    """Groups of modules or packages of one folder that import each other, by any way round and
    anywhere in a file."""
    modules = {_module(file.path): file for file in files}
    edges: dict[str, set[str]] = defaultdict(set)
    for name, file in modules.items():
        for target in _imports(name, file):
            while target and target not in modules:
                target = target.rpartition(".")[0]
            if not target:
                continue
            own, other = name.split("."), target.split(".")
            shared = sum(
                1 for _ in takewhile(lambda pair: pair[0] == pair[1], zip(own, other, strict=False))
            )
            if shared < min(len(own), len(other)):  # neither holds the other
                edges[".".join(own[: shared + 1])].add(".".join(other[: shared + 1]))
    return sorted(_strongly_connected(edges))


def _module(path: Path) -> str:
    parts = [PACKAGE, *path.with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imports(name: str, file: SourceFile) -> Iterator[str]:
    package = name if file.path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(file.tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.startswith(PACKAGE))
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parts = package.split(".")
                base = ".".join(
                    [*parts[: len(parts) - node.level + 1], *filter(None, [node.module])]
                )
            if base.startswith(PACKAGE):
                yield from (f"{base}.{alias.name}" for alias in node.names)


def _strongly_connected(edges: dict[str, set[str]]) -> Iterator[list[str]]:
    """Tarjan's algorithm (1972); groups of one are left out."""
    index: dict[str, int] = {}
    lowest: dict[str, int] = {}
    stack: list[str] = []
    groups: list[list[str]] = []

    def visit(node: str) -> None:
        index[node] = lowest[node] = len(index)
        stack.append(node)
        for target in sorted(edges.get(node, ())):
            if target not in index:
                visit(target)
                lowest[node] = min(lowest[node], lowest[target])
            elif target in stack:
                lowest[node] = min(lowest[node], index[target])
        if lowest[node] == index[node]:
            start = stack.index(node)
            if len(stack) - start > 1:
                groups.append(sorted(stack[start:]))
            del stack[start:]

    for node in sorted(edges):
        if node not in index:
            visit(node)
    yield from groups


def words_of(paths: Iterable[Path]) -> int:
    """Words of Markdown, code blocks left out."""
    texts = (
        re.sub(r"^```.*?^```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
        for path in paths
    )
    return sum(len(text.split()) for text in texts)


def prose_pages(root: Path) -> list[Path]:
    """Pages of docs/ that a person wrote: a page that a program fills or writes says so by a
    mark."""
    pages = sorted((root / "docs").rglob("*.md"))
    written = [
        page for page in pages if not set(page.relative_to(root / "docs").parts) & set(GENERATED)
    ]
    return [page for page in written if not GENERATED_MARK.search(page.read_text(encoding="utf-8"))]


def figures(root: Path) -> dict[str, str]:
    """What the table shows, as text."""
    files = product_files(root)
    lines = [file.lines for file in files]
    functions = [length for file in files for length in function_lengths(file.tree)]
    all_lines = [line for file in files for line in file.text.splitlines()]
    locals_ = [name.id for file in files for name in assigned_locals(file.tree)]
    longest = max(files, key=lambda file: file.lines)
    banned = sum(name in BANNED for name in locals_)
    wide = sum(len(line) > WIDTH for line in all_lines)
    cycles = sibling_cycles(files)
    return {
        "product files": f"{len(files)}",
        "files under 40 lines": f"{sum(count < 40 for count in lines)}",
        "lines": f"{sum(lines):,}",
        "lines of code": f"{sum(code_lines(file.text) for file in files):,}",
        "lines of a file, median": f"{statistics.median(lines):g}",
        "lines of a function, median": f"{statistics.median(functions):g}",
        "longest file": f"{longest.path} ({longest.lines})",
        f"lines over {WIDTH} characters": f"{100 * wide / len(all_lines):.1f} %",
        "assigned locals that say nothing": f"{100 * banned / len(locals_):.2f} "
        f"% ({banned} of {len(locals_):,})",
        "class names defined more than once": f"{len(duplicate_classes(files))}",
        "groups of siblings that import each other": f"{len(cycles)} ({sum(map(len, cycles))} of "
        "them)",
        "lines of benchmarks": f"{_python_lines(root / 'benchmarks'):,}",
        "lines of tests": f"{_python_lines(root / 'tests'):,}",
        "words of docs": f"{words_of(prose_pages(root)):,}",
        "words of README": f"{words_of([root / 'README.md']):,}",
    }


def _python_lines(folder: Path) -> int:
    return sum(path.read_text(encoding="utf-8").count("\n") for path in folder.rglob("*.py"))


def problems(root: Path) -> list[str]:
    """Names that the lint refuses, with their places."""
    files = product_files(root)
    lines = [
        f"{file.path}:{line}: {name!r} says nothing about what it holds; name it by its noun"
        for file in files
        for name, line in (
            *((local.id, local.lineno) for local in assigned_locals(file.tree)),
            *((parameter.arg, parameter.lineno) for parameter in parameters(file.tree)),
        )
        if name in BANNED
    ]
    for name, places in sorted(duplicate_classes(files).items()):
        lines.append(
            f"{places[0]}: class {name} is also defined in "
            f"{', '.join(places[1:])}; one class, one name"
        )
    return lines


def _unpack_commit(commit: str, folder: Path) -> None:
    command = ["git", "archive", commit]
    archive = subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout
    with tarfile.open(fileobj=io.BytesIO(archive)) as files:
        files.extractall(folder, filter="data")


def main(arguments: Sequence[str]) -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("commit", nargs="?", help="a commit to show beside this tree")
    parser.add_argument(
        "--lint", action="store_true", help="list the names to change; fails where there are any"
    )
    options = parser.parse_args(arguments)
    if options.lint:
        lines = problems(ROOT)
        print("\n".join(lines))
        return int(bool(lines))
    columns = {"now": figures(ROOT)}
    if options.commit:
        with tempfile.TemporaryDirectory() as folder:
            _unpack_commit(options.commit, Path(folder))
            columns = {options.commit: figures(Path(folder)), **columns}
    print("| | " + " | ".join(columns) + " |\n|" + " --- |" * (len(columns) + 1))
    for name in columns["now"]:
        print(f"| {name} | " + " | ".join(column[name] for column in columns.values()) + " |")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
