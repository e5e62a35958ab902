"""The shell's completion: names of the store that is meant, quickly, and nothing else ever."""

from __future__ import annotations

import os
import re
import select
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import IO

import pytest
from click.shell_completion import ShellComplete
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.operations.command_words import COMMANDS
from pyroshock.schema.tables import metadata
from pyroshock.twin.effects import catalogue
from support.missing import needs_program

REPOSITORY = Path(__file__).resolve().parents[2]
NAMED = {
    "campaigns": "first-shots",
    "plans": "spring",
    "dataset_snapshots": "both",
    "materials": "steel",
}


def completed(*words: str) -> list[str]:
    return [
        item.value
        for item in ShellComplete(main, {}, "pyroshock", "_X").get_completions(
            list(words[:-1]), words[-1]
        )
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
        connection.execute(
            "create table model_versions (name text, version int, current_stage text)"
        )
        connection.execute(
            "create table registered_model_aliases (alias text, name text, version int)"
        )
        connection.executemany(
            "insert into model_versions values (?, ?, ?)",
            [
                ("tree", 1, None),
                ("tree", 2, "None"),
                ("linear", 1, "None"),
                ("linear", 2, "Deleted_Internal"),
            ],
        )
        connection.execute("insert into registered_model_aliases values ('champion', 'tree', 2)")
        connection.commit()
    return f"sqlite:///{folder / 'lab.db'}"


def test_the_tables_have_these_columns():
    """The statements name tables of the store and of MLflow in words, for neither library is
    imported."""
    from mlflow.store.model_registry.dbmodels import models

    assert all("name" in metadata.tables[table].columns for table in NAMED)
    versions, aliases = models.SqlModelVersion.__table__, models.SqlRegisteredModelAlias.__table__
    assert versions.name == "model_versions" and {"name", "version", "current_stage"} <= set(
        versions.columns.keys()
    )
    assert aliases.name == "registered_model_aliases" and {"name", "alias"} <= set(
        aliases.columns.keys()
    )


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


def test_the_option_goes_before_the_environment_and_commands_and_effects_are_offered(
    store, monkeypatch
):
    monkeypatch.setenv("PYROSHOCK_DB", "sqlite:///other.db")
    assert (
        completed("validate", "--db", store, "") == ["first-shots"]
        and completed("validate", "") == []
    )
    assert completed("dataset", "--db", store, "build", "x", "--from", "") == ["first-shots"]
    assert sorted(completed("diagnose", "x", "--with", "")) == sorted(catalogue())
    assert completed("diagnose", "x", "--without", "gun.leak,sensor.zero") == [
        "gun.leak,sensor.zero_shift"
    ]
    assert completed("") == list(COMMANDS) and completed("pl") == [
        "plan",
        "plans",
        "plugins",
    ]
    assert "--sort" in completed("impacts", "--s")


@pytest.mark.parametrize(
    "address",
    ["sqlite:///missing.db", "sqlite:///damaged.db", "sqlite:///no/folder/lab.db", "sqlite://",
     "nonsense", "mysql://x", "postgresql+psycopg://nobody@127.0.0.1:1/lab", ""],
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


#: What a person types before the tab key -> the words that the command then gets.
TYPED = {
    "pyroshock validate fi": "validate first-shots",
    "pyroshock models show tree@1": "models show tree@1",
    "pyroshock dataset build x --from spring,fi": "dataset build x --from spring,first-shots",
    "pyroshock diagnose x --without "
    "gun.leak,sensor.zero": "diagnose x --without gun.leak,sensor.zero_shift",
    "pyroshock predict --contact=lin": "predict --contact=linear@1",
    "pyroshock promote linear@": "promote linear@1",
}
WAIT_S = 40.0


def documented_line(shell: str, home: Path) -> tuple[Path, str]:
    """The file below `home`, and the line that the documentation says to add to it."""
    page = (REPOSITORY / "docs" / "reference" / "command-overview.md").read_text(encoding="utf-8")
    row = next(line for line in page.splitlines() if line.startswith(f"| {shell} "))
    file, line = re.findall(r"`((?:[^`])+)`", row)
    return home / file.removeprefix("~/"), line.replace("\\|", "|")


@pytest.fixture(params=["bash", "zsh", "fish"])
def shell_home(request, store, tmp_path, monkeypatch) -> Path:
    """The home of a person who has done what the documentation says; `pyroshock` notes what it is
    called with."""
    needs_program(request.param)
    home = tmp_path / request.param
    script = tmp_path / "bin" / "pyroshock"
    script.parent.mkdir()
    script.write_text(
        f"""#!/bin/sh
if [ -z "$_PYROSHOCK_COMPLETE" ]; then echo "$@" > {home}/typed; exit; fi
{sys.executable} -P -m pyroshock "$@"
echo "$_PYROSHOCK_COMPLETE" >> {home}/answered
""",
        encoding="utf-8",
    )
    script.chmod(0o755)
    file, line = documented_line(request.param, home)
    file.parent.mkdir(parents=True)
    file.write_text(f"{line}\n", encoding="utf-8")
    environment = {
        "HOME": home,
        "PYROSHOCK_DB": store,
        "TERM": "dumb",
        "PATH": f"{script.parent}:{os.environ['PATH']}",
    }
    for name, value in environment.items():
        monkeypatch.setenv(name, str(value))
    for name in ("ZDOTDIR", "XDG_CONFIG_HOME"):
        monkeypatch.delenv(name, raising=False)
    return home


def read_until_silent(output: IO[bytes], silent_s: float) -> str:
    """What the shell writes, until it has written nothing for so long."""
    text = b""
    while select.select([output], [], [], silent_s)[0] and (
        part := os.read(output.fileno(), 65536)
    ):
        text += part
    return text.decode(errors="replace")


def read_until_ready(shell: str, output: IO[bytes], silent_s: float) -> str:
    """What the shell writes until it takes the next line. bash writes its prompt then, and nothing
    after it; the others draw their line several times, and are waited for until they are silent."""
    if shell != "bash":
        return read_until_silent(output, silent_s)
    text = b""
    while not re.search(rb"[$#] $", text) and select.select([output], [], [], WAIT_S)[0]:
        if not (part := os.read(output.fileno(), 65536)):
            break
        text += part
    return text.decode(errors="replace")


def wait_for(file: Path, text: str) -> str:
    """What the file holds once `text` stands in it."""
    end = time.monotonic() + WAIT_S
    while time.monotonic() < end:
        if file.exists() and text in file.read_text(encoding="utf-8"):
            return file.read_text(encoding="utf-8")
        time.sleep(0.05)
    return ""


def test_the_tab_key_completes_in_each_shell_as_documented(shell_home: Path):
    """The shell runs in a terminal; what is typed ends with the tab key and, after the answer, with
    the return key."""
    shell = shell_home.name
    in_terminal = [sys.executable, "-c", "import pty, sys; pty.spawn(sys.argv[1:])", shell, "-i"]
    with subprocess.Popen(
        in_terminal, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0
    ) as process:
        assert process.stdin is not None and process.stdout is not None
        try:
            assert "not found" not in read_until_ready(shell, process.stdout, 3.0)
            for typed, expected in TYPED.items():
                for name in ("typed", "answered"):
                    (shell_home / name).unlink(missing_ok=True)
                process.stdin.write(f"{typed}\t".encode())
                assert wait_for(shell_home / "answered", f"{shell}_complete"), typed
                if shell != "bash":  # bash takes keys in the order in which they are typed
                    read_until_silent(process.stdout, 0.5)
                process.stdin.write(b"\r")
                assert wait_for(shell_home / "typed", "\n").strip() == expected
                read_until_ready(shell, process.stdout, 0.5)
        finally:
            process.kill()


def test_completion_imports_neither_sqlalchemy_nor_mlflow(store):
    code = (
        "import sys; from click.shell_completion import ShellComplete; from "
        "pyroshock.app.doors.command_line.main import main\n"
        "for words in (['validate'], ['promote'], ['impacts', '--campaign'], "
        "['diagnose', 'x', '--with'], []):\n"
        "    assert ShellComplete(main, {}, 'pyroshock', '_X').get_completions(words, '')\n"
        "print(sorted({'sqlalchemy', 'mlflow', 'pandas', 'numpy', 'torch'} & set(sys.modules)))"
    )
    environment = {**os.environ, "PYROSHOCK_DB": store}
    ran = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60
    )
    assert ran.stdout.strip() == "[]", ran.stderr
