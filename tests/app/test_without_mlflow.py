"""Commands that list models, compare them or predict without one do not import MLflow, which takes
seconds."""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from support.stores.web_stores import filled_lab

__all__ = ["filled_lab"]

#: A command as the installed one runs it, with plates that are solved at once.
RUN = """
import json, sys
from pyroshock.app.twins import building
from support.records.twin_parts import unsolved

building.solved = unsolved
from pyroshock.app.doors.command_line.main import main

sys.argv[0] = "pyroshock"
try:
    main()
except SystemExit as ended:
    code = ended.code or 0
print(json.dumps({"code": code, "mlflow": "mlflow" in sys.modules}))
"""
TESTS = Path(__file__).resolve().parent.parent


def run_command(folder: Path, *words: str) -> dict[str, object]:
    """How a command ended in a process of its own, and whether it had imported MLflow."""
    environment = {
        name: value for name, value in os.environ.items() if name != "MLFLOW_TRACKING_URI"
    }
    process = subprocess.run(
        [sys.executable, "-c", RUN, *words, "--db", f"sqlite:///{folder / 'lab.db'}"],
        env={**environment, "PYTHONPATH": str(TESTS)},
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(process.stdout.splitlines()[-1])


LISTS = (
    ("models", "list"),
    ("models", "list", "--promotions"),
    ("models", "show", "tree@1"),
    ("compare", "linear@1", "tree@1"),
)


@pytest.mark.parametrize("words", LISTS)
def test_lists_and_comparisons_import_no_mlflow(filled_lab, words):
    assert run_command(filled_lab, *words) == {"code": 0, "mlflow": False}


@pytest.mark.parametrize("contact", [(), ("--contact", "tree@1")])
def test_predictions_import_no_mlflow(filled_lab, contact):
    shot = ("--tank-pressure", "2bar", "--draws", "8")
    assert run_command(filled_lab, "predict", *shot, *contact) == {"code": 0, "mlflow": False}


def test_prediction_without_a_registry_imports_no_mlflow(tmp_path):
    shot = ("--tank-pressure", "2bar", "--draws", "8")
    assert run_command(tmp_path, "predict", *shot) == {"code": 0, "mlflow": False}
    assert run_command(tmp_path, "models", "list") == {"code": 0, "mlflow": False}


def test_unknown_tables_import_mlflow(filled_lab, tmp_path):
    """Else the tests above would see nothing."""
    for name in ("lab.db", "lab-models.db"):
        shutil.copy(filled_lab / name, tmp_path)
    with closing(sqlite3.connect(tmp_path / "lab-models.db")) as connection, connection:
        connection.execute("UPDATE alembic_version SET version_num = 'from-the-future'")
    assert run_command(tmp_path, "models", "list")["mlflow"]
