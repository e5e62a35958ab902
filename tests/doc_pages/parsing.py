"""Whether a command exists: the command and its options, the target of the Makefile, the module,
the extra."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from functools import cache
from pathlib import Path

import click
from pyroshock.app.doors.command_line.main import main

from .blocks import Statement

ROOT = Path(__file__).resolve().parents[2]
#: Programs that are not ours; a name that is neither is a slip of the pen.
OTHERS = frozenset(
    {
        *(
            "cat",
            "cd",
            "cp",
            "echo",
            "export",
            "git",
            "ls",
            "mkdir",
            "mv",
            "printf",
            "rm",
            "sed",
            "sh",
            "sudo",
            "tar",
        ),
        *("createdb", "pg_dump", "pg_restore", "psql", "sqlite3"),
        *("dask", "docker", "mlflow", "pre-commit"),
    }
)


def check(statement: Statement) -> None:
    """Raises `AssertionError`, or click's error, that says what is not there."""
    program, words = statement.program, statement.words
    if program == "pyroshock":
        if words[-1:] not in (("--help",), ("-h",), ("--version",)):
            parsed(list(words))
    elif program == "make":
        missing = {word for word in words if "=" not in word} - targets()
        assert not missing, f"{statement}: the Makefile has no {missing}"
        unknown = {word.split("=")[0] for word in words if "=" in word} - variables()
        assert not unknown, f"{statement}: the Makefile has no {unknown}"
    elif program in ("python", "python3"):
        _check_python(statement)
    elif program == "pip":
        asked = {
            name
            for word in words
            for group in re.findall(r"\[(.*)\]", word)
            for name in group.split(",")
        }
        assert asked <= extras(), f"{statement}: pyproject.toml has no {asked - extras()}"
    else:
        assert program in OTHERS, f"{statement}: no program that a page of ours runs"


def parsed(words: list[str]) -> click.Context:
    """As the command line takes these words, down to the command itself, without running it."""
    command: click.Command = main
    context = main.make_context("pyroshock", list(words))
    while isinstance(command, click.Group) and context._protected_args:
        name, subcommand, rest = command.resolve_command(
            context, [*context._protected_args, *context.args]
        )
        assert subcommand is not None, f"pyroshock {' '.join(words)}: there is no such command"
        command, context = subcommand, subcommand.make_context(name, rest, parent=context)
    return context


def _check_python(statement: Statement) -> None:
    match statement.words:
        case ("-m", module, *_):
            path, top = ROOT.joinpath(*module.split(".")), module.split(".")[0]
            ours = path.with_suffix(".py").is_file() or (path / "__main__.py").is_file()
            others = not (ROOT / top).exists() and importlib.util.find_spec(top) is not None
            assert ours or others, f"{statement}: there is no such module"
        case (script, *_) if not script.startswith("-"):
            assert (ROOT / script).is_file(), f"{statement}: there is no such script"


@cache
def targets() -> frozenset[str]:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    return frozenset(re.findall(r"^([a-z][a-z-]*):", makefile, re.MULTILINE))


@cache
def variables() -> frozenset[str]:
    """Those that the Makefile sets or asks for."""
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    return frozenset(
        re.findall(r"^([A-Z]+) [?:]?=", makefile, re.MULTILINE)
        + re.findall(r"\$\(([A-Z]+)\)", makefile)
    )


@cache
def extras() -> frozenset[str]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    return frozenset(project["optional-dependencies"])
