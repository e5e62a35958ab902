"""Every notebook of the documentation runs in an empty folder, is short, draws, and has its
page."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tools import notebooks

NOTEBOOKS = sorted(notebooks.FOLDER.glob("*.py"))
#: Those that the default tests leave out: `make docs`, which CI runs, runs every notebook and fails
#: where one does.
SLOW = {file.stem for file in NOTEBOOKS} - {"ingest_and_look"}
FEWEST_PICTURES = 2


def _marks(file: Path) -> list[pytest.MarkDecorator]:
    limit = pytest.mark.timeout(600)
    return [pytest.mark.slow, limit] if file.stem in SLOW else [limit]


def run(file: Path) -> subprocess.CompletedProcess[str]:
    """In a process of its own: a kernel's client opens event loops and sockets that pytest would
    take for leaks."""
    environment = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYROSHOCK_", "MLFLOW_"))
    }
    command = [sys.executable, "-m", "tools.notebooks", str(file)]
    return subprocess.run(
        command, cwd=notebooks.ROOT, env=environment, capture_output=True, text=True, timeout=600
    )


@pytest.mark.parametrize(
    "file", [pytest.param(file, id=file.stem, marks=_marks(file)) for file in NOTEBOOKS]
)
def test_notebook_runs_and_draws(file):
    ran = run(file)
    assert ran.returncode == 0, ran.stderr[-3000:]
    pictures = int(ran.stdout.split()[-2])
    assert pictures >= FEWEST_PICTURES, ran.stdout


@pytest.mark.parametrize("file", NOTEBOOKS, ids=lambda file: file.stem)
def test_notebook_is_short_has_its_page_and_uses_the_public_names_alone(file):
    assert len(notebooks.read_notebook(file).cells) <= notebooks.MOST_CELLS
    assert notebooks.MARK.findall(file.with_suffix(".md").read_text(encoding="utf-8")) == [
        file.name
    ]
    imports = [
        line
        for line in file.read_text(encoding="utf-8").splitlines()
        if "import" in line and "pyroshock" in line
    ]
    assert imports == ["import pyroshock as ps"]


def test_a_cell_that_fails_is_an_error_and_a_long_notebook_is_refused(tmp_path):
    (tmp_path / "bad.py").write_text("# %%\nprint(1)\n\n# %%\n1 / 0\n", encoding="utf-8")
    ran = run(tmp_path / "bad.py")
    assert ran.returncode != 0 and "ZeroDivisionError" in ran.stderr
    (tmp_path / "long.py").write_text("# %%\nprint(1)\n\n" * 40, encoding="utf-8")
    with pytest.raises(ValueError, match=r"long\.py has 40 cells; expected 39 or fewer"):
        notebooks.read_notebook(tmp_path / "long.py")


def test_results_are_shown_below_their_cell_and_there_are_notebooks():
    from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

    outputs = [
        new_output("stream", text="printed\n"),
        new_output("display_data", {"image/png": "QUJD\n", "text/plain": "<Figure>"}),
        new_output("execute_result", {"text/plain": "42"}),
    ]
    notebook = new_notebook(
        cells=[new_markdown_cell("# Title"), new_code_cell("work()", outputs=outputs)]
    )
    assert notebooks.as_markdown(notebook).split("\n\n") == [
        "# Title",
        "```python\nwork()\n```",
        "```text\nprinted\n```",
        '<img alt="drawn by the cell above" src="data:image/png;base64,QUJD">',
        "```text\n42\n```",
    ]
    assert (
        notebooks.pictures_of(notebook) == ["QUJD\n"] and {file.stem for file in NOTEBOOKS} > SLOW
    )
