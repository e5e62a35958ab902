"""A reader who follows one recording from `ingest_folder` to its commit goes down through the
files, and hardly ever has to climb back to a file that was left."""

from __future__ import annotations

import ast
from pathlib import Path

import pyroshock.ingest

ROOM = Path(pyroshock.ingest.__path__[0])
#: What every step uses: the faults of a folder, and the readers behind `RecordingFiles.open`.
COMMON = ("errors", "readers")
#: Who is called by these names is not of this room.
STORES = {"store", "_store", "session", "report"}

Function = tuple[str, str]  # module within the room, and name


class Code:
    """The functions of the room, and what each name in a module stands for."""

    def __init__(self) -> None:
        self.functions: dict[Function, ast.FunctionDef] = {}
        self.methods: dict[str, list[Function]] = {}
        self.imported: dict[str, dict[str, Function]] = {}
        for path in ROOM.rglob("*.py"):
            self._add(path)

    def _add(self, path: Path) -> None:
        *package, _ = parts = path.relative_to(ROOM).with_suffix("").parts
        module, tree = ".".join(parts), ast.parse(path.read_text(encoding="utf-8"))
        self.imported[module] = {
            alias.asname or alias.name: (_absolute(package, node), alias.name)
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom) and 0 < node.level <= len(package) + 1
            for alias in node.names
        }
        for node in tree.body:
            if isinstance(node, ast.FunctionDef):
                self.functions[module, node.name] = node
            elif isinstance(node, ast.ClassDef) and not node.decorator_list:
                self._add_methods(module, node)

    def _add_methods(self, module: str, node: ast.ClassDef) -> None:
        """Those of a record are read with it, where it is first met."""
        for function in node.body:
            if isinstance(function, ast.FunctionDef):
                name = node.name if function.name == "__init__" else f"{node.name}.{function.name}"
                self.functions[module, name] = function
                self.methods.setdefault(function.name, []).append((module, name))

    def target(self, module: str, node: ast.expr) -> Function | None:
        """The function of the room that a name or an attribute stands for."""
        if isinstance(node, ast.Name):
            target = self.imported[module].get(node.id, (module, node.id))
        elif isinstance(node, ast.Attribute):
            owner = node.value.attr if isinstance(node.value, ast.Attribute) else ""
            owner = node.value.id if isinstance(node.value, ast.Name) else owner
            methods = self.methods.get(node.attr, [])
            if owner == "self":
                methods = [method for method in methods if method[0] == module]
            if owner in STORES or len(methods) != 1:
                return None
            (target,) = methods
        else:
            return None
        return target if target in self.functions and not target[0].startswith(COMMON) else None


def _absolute(package: list[str], node: ast.ImportFrom) -> str:
    base = package[: len(package) - node.level + 1]
    return ".".join([*base, node.module] if node.module else base)


def climbs(start: Function) -> tuple[list[tuple[str, Function]], list[str]]:
    """Calls that lead from a module to a function, not read yet, of a module that was entered
    before it; and the modules in the order in which they are entered. Calls are read in the order
    of the text, each to its end."""
    code, entered, read = Code(), [start[0]], {start}
    upwards: list[tuple[str, Function]] = []

    def follow(function: Function) -> None:
        module = function[0]
        expressions = [n for n in ast.walk(code.functions[function]) if isinstance(n, ast.expr)]
        expressions.sort(key=lambda n: (n.end_lineno or 0, n.end_col_offset or 0))
        for node in expressions:
            target = code.target(module, node)
            if target is None or target in read:
                continue
            read.add(target)
            if target[0] not in entered:
                entered.append(target[0])
            elif entered.index(target[0]) < entered.index(module):
                upwards.append((module, target))
            follow(target)

    follow(start)
    return upwards, entered


def test_way_of_a_recording_climbs_to_shared_formulas_only() -> None:
    upwards, entered = climbs(("load", "ingest_folder"))
    assert {target for _, target in upwards} == {
        ("folder.column_names", "resembled_channel"),
        ("extraction.deconvolution", "clean_acceleration"),
        ("extraction.velocity", "impact_velocity"),
        ("extraction.gunshot", "measure_shot"),
    }
    # it goes as far as the rows, through every step
    steps = ["folder.runs_table", "extraction.pulses", "storing.row_values"]
    assert [module for module in entered if module in steps] == steps
