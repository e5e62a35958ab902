"""The shell's completion: names of the store that is meant, quickly, and nothing else ever."""

from __future__ import annotations

import os
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from click.shell_completion import BashComplete, ShellComplete, get_completion_class
from click.testing import CliRunner
from pyroshock.app.cli.main import COMMANDS, main
from pyroshock.schema.tables import metadata
from pyroshock.twin.effects import catalogue

NAMED = {"campaigns": "first-shots", "plans": "spring", "dataset_snapshots": "both", "materials": "steel"}


def completed(*words: str) -> list[str]:
    return [
        item.value for item in ShellComplete(main, {}, "pyroshock", "_X").get_completions(list(words[:-1]), words[-1])
    ]


@pytest.fixture(scope="module")
def store(tmp_path_factory) -> str:
    """The tables that names are read from, as far as they are read, and MLflow's beside them."""
    folder = tmp_path_factory.mktemp("completion")
    with closing(sqlite3.connect(folder / "lab.db")) as connection:
        for table, name in NAMED.items():
            connection.execute(f"create table {table} (name text)")
            connection.execute(f"insert into {table} values (?)", [name])
        connection.execute("create table diagnoses (id int)")
        connection.execute("insert into diagnoses values (7)")
        connection.commit()
    with closing(sqlite3.connect(folder / "lab-models.db")) as connection:
        connection.execute("create table model_versions (name text, version int, current_stage text)")
        connection.execute("create table registered_model_aliases (alias text, name text, version int)")
        connection.executemany(
            "insert into model_versions values (?, ?, ?)",
            [("tree", 1, None), ("tree", 2, "None"), ("linear", 1, "None"), ("linear", 2, "Deleted_Internal")],
        )
        connection.execute("insert into registered_model_aliases values ('champion', 'tree', 2)")
        connection.commit()
    return f"sqlite:///{folder / 'lab.db'}"


def test_the_tables_have_these_columns():
    """The statements name tables of the store and of MLflow in words, for neither library is imported."""
    from mlflow.store.model_registry.dbmodels import models

    assert all("name" in metadata.tables[table].columns for table in NAMED)
    versions, aliases = models.SqlModelVersion.__table__, models.SqlRegisteredModelAlias.__table__
    assert versions.name == "model_versions" and {"name", "version", "current_stage"} <= set(versions.columns.keys())
    assert aliases.name == "registered_model_aliases" and {"name", "alias"} <= set(aliases.columns.keys())


@pytest.fixture(autouse=True)
def _clean(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    for name in ("PYROSHOCK_DB", "MLFLOW_TRACKING_URI"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize(("words", "expected"), [
    (("validate", ""), ["first-shots"]),
    (("impacts", "--campaign", "first"), ["first-shots"]),
    (("impacts", "--campaign", "other"), []),
    (("runs", "list", ""), ["first-shots"]),
    (("dataset", "build", "x", "--from", ""), ["first-shots"]),
    (("dataset", "build", "x", "--from", "spring,fi"), ["spring,first-shots"]),
    (("campaigns", "show", ""), ["first-shots"]),
    (("plans", "delete", ""), ["spring"]),
    (("datasets", "show", ""), ["both"]),
    (("models", "tree@"), ["tree@champion", "tree@2", "tree@1"]),
    (("models", "delete", "linear"), ["linear@1"]),
    (("predict", "--contact", "l"), ["linear@1"]),
    (("diagnoses", "show", ""), ["7"]),
    (("plan", "sheet", ""), ["spring"]),
    (("ingest", "--plan", "s"), ["spring"]),
    (("train", ""), ["both"]),
    (("dataset", "show", "b"), ["both"]),
    (("predict", "--tip", "st"), ["steel"]),
    (("promote", ""), ["tree@champion", "linear@1", "tree@2", "tree@1"]),
    (("compare", "linear@1", "tree@1"), ["tree@1"]),
    (("report", "f"), ["first-shots"]),
])  # fmt: skip
def test_names_of_the_store_are_offered(store, words, expected, monkeypatch):
    monkeypatch.setenv("PYROSHOCK_DB", store)
    assert completed(*words) == expected


def test_the_option_goes_before_the_environment_and_commands_and_effects_are_offered(store, monkeypatch):
    monkeypatch.setenv("PYROSHOCK_DB", "sqlite:///other.db")
    assert completed("validate", "--db", store, "") == ["first-shots"] and completed("validate", "") == []
    assert completed("dataset", "--db", store, "build", "x", "--from", "") == ["first-shots"]
    assert sorted(completed("diagnose", "x", "--with", "")) == sorted(catalogue())
    assert completed("diagnose", "x", "--without", "gun.leak,sensor.zero") == ["gun.leak,sensor.zero_shift"]
    assert completed("") == list(COMMANDS) and completed("pl") == ["plan", "plans"]
    assert "--sort" in completed("impacts", "--s")


@pytest.mark.parametrize(
    "address",
    ["sqlite:///missing.db", "sqlite:///damaged.db", "sqlite:///no/folder/lab.db", "sqlite://", "nonsense", "mysql://x",
     "postgresql+psycopg://nobody@127.0.0.1:1/lab", ""],
)  # fmt: skip
@pytest.mark.parametrize("words", [("validate", ""), ("promote", "")])
def test_no_store_has_no_names_and_is_not_made(address, words, monkeypatch, tmp_path):
    (tmp_path / "damaged.db").write_bytes(b"no database at all" * 100)
    monkeypatch.setenv("PYROSHOCK_DB", address)
    before = sorted(path.name for path in tmp_path.iterdir())
    assert completed(*words) == [] and sorted(path.name for path in tmp_path.iterdir()) == before


def test_names_come_from_a_server_too(postgres_url, monkeypatch):
    from support.stores.databases import fresh_database

    with fresh_database(postgres_url) as url:
        assert CliRunner().invoke(main, ["init", "--db", url]).exit_code == 0
        monkeypatch.setenv("PYROSHOCK_DB", url)
        assert completed("predict", "--tip", "st") == ["steel"]


def program(folder: Path) -> dict[str, str]:
    """The environment in which `pyroshock` is this checkout's."""
    script = folder / "pyroshock"
    script.write_text(f'#!/bin/sh\nexec {sys.executable} -P -m pyroshock "$@"\n', encoding="utf-8")
    script.chmod(0o755)
    return {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"}


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_bash_completes(store, tmp_path):
    """As a person has it: the script of the documentation is sourced, and bash asks it for a word."""
    script = BashComplete(main, {}, "pyroshock", "_PYROSHOCK_COMPLETE").source()
    asked = "COMP_WORDS=(pyroshock validate fi) COMP_CWORD=2; _pyroshock_completion pyroshock; echo ${COMPREPLY[@]}"
    words = [shutil.which("bash") or "", "--norc", "-c", f"{script}\n{asked}"]
    environment = program(tmp_path) | {"PYROSHOCK_DB": store}
    ran = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=60)
    assert (ran.stdout.strip(), ran.stderr) == ("first-shots", "")


@pytest.mark.parametrize(("shell", "commands"), [
    ("zsh", "autoload -U compinit; compinit -D; {script}; whence -w _pyroshock_completion"),
    ("fish", "{script}; complete -C 'pyroshock validate fi'"),
])  # fmt: skip
def test_zsh_and_fish_take_the_script_of_the_documentation(shell, commands, store, tmp_path):
    """Where the shell is installed; its script is made everywhere, and names the program."""
    script = get_completion_class(shell)(main, {}, "pyroshock", "_PYROSHOCK_COMPLETE").source()
    assert f"_PYROSHOCK_COMPLETE={shell}_complete" in script and "pyroshock" in script
    if shutil.which(shell) is None:
        pytest.skip(f"{shell} is not installed: its script was made above, and is run where it is")
    environment = program(tmp_path) | {"PYROSHOCK_DB": store}
    words = [shell, "-c", commands.format(script=script)]
    ran = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=60)
    assert ran.returncode == 0 and ("first-shots" in ran.stdout or "function" in ran.stdout), ran.stderr


@pytest.mark.parametrize(("shell", "typed", "expected"), [
    ("bash", {"COMP_WORDS": "pyroshock validate fi", "COMP_CWORD": "2"}, "plain,first-shots"),
    ("zsh", {"COMP_WORDS": "pyroshock validate fi", "COMP_CWORD": "2"}, "plain\nfirst-shots\n_"),
    ("fish", {"COMP_WORDS": "pyroshock validate fi", "COMP_CWORD": "fi"}, "plain"),
])  # fmt: skip
def test_each_shell_gets_its_answer_in_its_own_form(shell, typed, expected, store, tmp_path):
    environment = program(tmp_path) | {"PYROSHOCK_DB": store, "_PYROSHOCK_COMPLETE": f"{shell}_complete"} | typed
    ran = subprocess.run([str(tmp_path / "pyroshock")], env=environment, capture_output=True, text=True, timeout=60)
    assert ran.stdout.startswith(expected) and "first-shots" in ran.stdout, ran.stderr


def test_completion_imports_neither_sqlalchemy_nor_mlflow(store):
    code = (
        "import sys; from click.shell_completion import ShellComplete; from pyroshock.app.cli.main import main\n"
        "for words in (['validate'], ['promote'], ['impacts', '--campaign'], ['diagnose', 'x', '--with'], []):\n"
        "    assert ShellComplete(main, {}, 'pyroshock', '_X').get_completions(words, '')\n"
        "print(sorted({'sqlalchemy', 'mlflow', 'pandas', 'numpy', 'torch'} & set(sys.modules)))"
    )
    environment = {**os.environ, "PYROSHOCK_DB": store}
    ran = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60)
    assert ran.stdout.strip() == "[]", ran.stderr
