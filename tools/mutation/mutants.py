"""What can be changed in a module: cosmic-ray's operators, one change each."""

from __future__ import annotations

import ast
import random
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.ast.ast_query import ASTQuery
from cosmic_ray.mutating import mutate_code
from cosmic_ray.operators.provider import OperatorProvider
from parso.tree import Leaf, NodeOrLeaf

_OPERATORS = OperatorProvider()


@dataclass(frozen=True)
class Spot:
    """Where an operator can change a source: the how manyth of its places, on which line and in
    what definition."""

    operator: str
    occurrence: int
    line: int
    definition: str  # the function or class around it, "" for the module itself


@dataclass(frozen=True)
class Mutant:
    """One change of one module; what is alike in the first five is the same mutant."""

    module: str  # from the root, a/b.py
    definition: str
    before: str  # the line, or lines, that change
    after: str
    nth: int  # of several alike in one definition
    line: int
    operator: str
    code: str  # the whole module, changed

    @property
    def key(self) -> tuple[str, str, str, str, int]:
        return self.module, self.definition, self.before, self.after, self.nth


def spots(source: str, operators: Sequence[str], but: Sequence[str] = ()) -> list[Spot]:
    """Every place of a source, in the order of its lines, where an operator of these names finds
    something to change.

    Annotations are texts here (PEP 563), so a change in one changes nothing; nor is a keyword
    argument named in `but` changed.
    """
    nodes = list(ast_nodes(get_ast(source)))
    found = [spot for name in operators for spot in _spots(nodes, name, but)]
    return sorted(found, key=lambda spot: spot.line)


def _spots(nodes: Sequence[NodeOrLeaf], name: str, but: Sequence[str]) -> Iterator[Spot]:
    operator = _OPERATORS[name]()
    places = [(node, start) for node in nodes for start, _ in operator.mutation_positions(node)]
    for occurrence, (node, (line, _)) in enumerate(places):
        if not _idle(node, but):
            yield Spot(name, occurrence, line, ASTQuery(node).get_definition_name() or "")


def sample(among: Sequence[Spot], size: int | None, seed: str) -> list[Spot]:
    """`size` of them without replacement, by the seed, in their order; None: all."""
    if size is None or size >= len(among):
        return list(among)
    return [among[i] for i in sorted(random.Random(seed).sample(range(len(among)), size))]


def mutants_of(module: str, source: str, where: Sequence[Spot]) -> list[Mutant]:
    """The mutants of a module at these places; what does not compile is none."""
    seen: Counter[tuple[str, str, str]] = Counter()
    found = []
    for spot in where:
        code = mutate_code(source, _OPERATORS[spot.operator](), spot.occurrence)
        if code is None or not _compiles(code):
            continue
        before, after = _change(source, code)
        alike = (spot.definition, before, after)
        found.append(
            Mutant(
                module, spot.definition, before, after, seen[alike], spot.line, spot.operator, code
            )
        )
        seen[alike] += 1
    return found


def on_lines(source: str, places: Sequence[Spot], texts: Sequence[str]) -> list[Spot]:
    """Those on a line that stands in one of these texts."""
    lines = [one_line([line]) for line in source.splitlines()]
    return [spot for spot in places if any(lines[spot.line - 1] in text for text in texts)]


def holds(source: str, before: str) -> bool:
    """Whether a source still has the line, or lines, that a mutant changes."""
    return before in one_line(source.splitlines())


def _idle(node: NodeOrLeaf, but: Sequence[str]) -> bool:
    """Whether it is in an annotation or in a keyword argument of one of these names, or is the * of
    a signature."""
    above = node.parent
    if above is not None and above.type == "parameters":
        return True
    while above is not None:
        place = above.children.index(node)
        if (above.type, place) in (("tfpdef", 2), ("annassign", 1)):
            return True
        if above.type == "funcdef" and above.children[place - 1] == "->":
            return True
        if above.type == "argument" and _first_word(above) in but:
            return True
        node, above = above, above.parent
    return False


def _first_word(node: NodeOrLeaf) -> str:
    leaf: Leaf = node.get_first_leaf()  # type: ignore[no-untyped-call]
    return leaf.value


def _compiles(code: str) -> bool:
    try:
        ast.parse(code)
    except SyntaxError:
        return False
    return True


def _change(source: str, code: str) -> tuple[str, str]:
    """The lines that differ, in one line each."""
    old, new = source.splitlines(), code.splitlines()
    first = next(i for i, (a, b) in enumerate(zip(old, new, strict=False)) if a != b)
    tail = next(
        i for i, (a, b) in enumerate(zip(reversed(old), reversed(new), strict=False)) if a != b
    )
    return one_line(old[first : len(old) - tail]), one_line(new[first : len(new) - tail])


def one_line(lines: Sequence[str]) -> str:
    """Lines as one, without what only lays them out."""
    text = " ".join(line.strip() for line in lines)
    return re.sub(r"(?<=[(\[{]) +", "", re.sub(r" +", " ", text))
