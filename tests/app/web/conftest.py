"""A store as the demo's first chapters leave it, with what its pages need beyond; each file of
tests has a copy."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from pyroshock.app.operations.diagnose.diagnosing import keep
from support.processes.browsers import Lab, browser, chromium, served
from support.processes.served_pages import address
from support.records.verdicts import explored, verdict
from support.stores.stores import opened, run_pyroshock

__all__ = ["address", "browser", "demo_store", "lab"]

#: As `pyroshock demo` names them.
DEMO_DB = "demo.db"


@pytest.fixture(scope="session")
def demo_store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the demo's first chapters, and in its store: two models of the rehearsal's
    pulses, and two diagnoses: one as an earlier version kept it, and one with all that a page
    shows.

    The plates of the virtual bench have few modes, as in the demo's own tests: solving for all
    takes half a minute.
    """
    chromium()

    from pyroshock.virtualbench.campaigns import ringing
    from support.stores.registries import without_figures

    out = tmp_path_factory.mktemp("demo") / "results"
    url = f"sqlite:///{out / DEMO_DB}"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ringing, "MAX_FREQUENCY_HZ", 500.0)
        without_figures(patch)
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        run_pyroshock("demo", "--out", out, "--chapters", "2")
        run_pyroshock("dataset", "build", "guns", "--from", "rehearsal", "--db", url)
        run_pyroshock(
            "train", "guns", "--models", "linear,hann", "--split", "configurations", "--db", url
        )
    with opened(url) as store:
        keep(store, verdict(campaign="first-shots"))
        keep(store, explored(campaign="first-shots"))
    return out


@pytest.fixture(scope="module")
def lab(demo_store: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """A server over a copy of that store, which the tests of one file share and may write to."""
    folder = tmp_path_factory.mktemp("lab")
    shutil.copytree(demo_store, folder, dirs_exist_ok=True)
    (folder / "campaigns").mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        with served(f"sqlite:///{folder / DEMO_DB}", folder / "campaigns") as window:
            yield window
