"""The documentation's notebooks: run in a kernel, and shown as Markdown with what they printed and
drew.

A notebook is a file of docs/notebooks in Jupyter's percent format (`# %%` before a cell), which a
reviewer reads as Python and Jupyter opens with jupytext. It is run in an empty folder, so that it
makes its own store.

    python -m tools.notebooks docs/notebooks/ingest_and_look.py
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "docs" / "notebooks"
#: A page shows the notebook that it names so.
MARK = re.compile(r"^<!-- notebook: (\w+\.py) -->$", re.MULTILINE)
#: No cell takes longer than this, in seconds.
LONGEST_CELL_S = 300
MOST_CELLS = 39


def read_notebook(file: Path) -> Any:
    """The notebook, not run. Raises `ValueError` for one with too many cells."""
    import jupytext

    notebook = jupytext.read(file, fmt="py:percent")
    if len(notebook.cells) > MOST_CELLS:
        raise ValueError(
            f"{file.name} has {len(notebook.cells)} cells; expected {MOST_CELLS} or fewer: split it"
        )
    return notebook


def run_notebook(file: Path, folder: Path) -> Any:
    """The notebook with its results, run in `folder`. Raises
    `nbclient.exceptions.CellExecutionError`."""
    from nbclient import NotebookClient

    notebook = read_notebook(file)
    place = {"metadata": {"path": str(folder)}}
    NotebookClient(
        notebook, timeout=LONGEST_CELL_S, kernel_name="python3", resources=place
    ).execute()
    return notebook


def pictures_of(notebook: Any) -> list[str]:
    """Pictures that a run drew: PNG in base64."""
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    return [output.data["image/png"] for output in outputs if "image/png" in output.get("data", {})]


def as_markdown(notebook: Any) -> str:
    """Text, code, and below each cell what it printed, showed and drew."""
    return "\n\n".join(part for cell in notebook.cells for part in _parts(cell))


def _parts(cell: Any) -> Iterator[str]:
    if cell.cell_type != "code":
        yield cell.source
        return
    yield f"```python\n{cell.source}\n```"
    for output in cell.outputs:
        if output.output_type == "stream":
            if output.name == "stderr":  # progress
                continue
            yield f"```text\n{output.text.rstrip()}\n```"
        elif "image/png" in output.data:
            data = output.data["image/png"].replace("\n", "")
            yield f'<img alt="drawn by the cell above" src="data:image/png;base64,{data}">'
        elif "text/html" in output.data:
            yield '<div class="output">' + " ".join(output.data["text/html"].split()) + "</div>"
        else:
            yield f"```text\n{output.data['text/plain'].rstrip()}\n```"


def shown(text: str) -> str:
    """A page with the notebook, run now, in the place of its mark."""
    return MARK.sub(lambda mark: run_and_shown(mark[1]), text)


def run_at_once(pages: Iterable[str]) -> None:
    """Run the notebooks of pages, as many at once as there are cores; `shown` then has them."""
    names = [mark[1] for page in pages for mark in MARK.finditer(page)]
    with ThreadPoolExecutor(os.cpu_count()) as kernels:  # a kernel is a process of its own
        list(kernels.map(run_and_shown, names))


@cache
def run_and_shown(name: str) -> str:
    """A notebook of docs/notebooks as Markdown, without its title, which its page has; run once in
    a process."""
    file = FOLDER / name
    with tempfile.TemporaryDirectory() as folder:
        text = as_markdown(run_notebook(file, Path(folder)))
    return text.partition("\n")[2] if text.startswith("# ") else text


if __name__ == "__main__":
    for argument in sys.argv[1:]:
        with tempfile.TemporaryDirectory() as empty:
            found = run_notebook(Path(argument), Path(empty))
        print(f"{argument}: {len(found.cells)} cells, {len(pictures_of(found))} pictures")
