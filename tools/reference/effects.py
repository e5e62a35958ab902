"""Every effect of the twin's catalogue."""

from __future__ import annotations

from pyroshock.twin.effects import Effect, Parameter, catalogue

from .markdown import code, escaped, joined, prose, table


def page() -> str:
    """A section an effect: law, source, what its file says, parameters."""
    return joined(*(_section(kind) for kind in catalogue().values()))


def _section(kind: type[Effect]) -> str:
    rows = [_row(item) for item in kind.parameters()]
    facts = [
        f"- stage: {kind.stage()}",
        f"- law: {code(kind.law)}",
        f"- source: {escaped(kind.source)}",
        f"- file: {code(kind.__module__.removeprefix('pyroshock.').replace('.', '/') + '.py')}",
    ]
    if kind.regimes:
        facts.append(
            "- looked for in turn: "
            f"{'; '.join(', '.join(map(code, names)) for names in kind.regimes)}"
        )
    header = [
        "parameter",
        "meaning",
        "unit",
        "range",
        "default",
        "off",
        "looked for in",
        "plausible",
    ]
    return joined(f"## {kind.id}", prose(kind.__doc__), "\n".join(facts), table(header, rows))


def _row(item: Parameter) -> tuple[str, ...]:
    likely = f"{item.likely[0]:g} to {item.likely[1]:g}" if item.likely else "not looked for"
    return (
        code(item.name),
        escaped(item.meaning),
        escaped(item.unit) or "1",
        f"{item.low:g} to {item.high:g}",
        f"{item.default:g}",
        f"{item.off:g}",
        likely,
        f"{item.plausible[0]:g} to {item.plausible[1]:g}" if item.plausible else "",
    )
