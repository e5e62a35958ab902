"""`import pyroshock`: cheap, complete, and every public name is there."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from pathlib import Path

import pyroshock as ps
import pytest

_HEAVY = {"numpy", "pandas", "scipy", "sqlalchemy", "torch", "mlflow", "matplotlib", "sklearn", "click"}


def test_every_public_name_is_there_and_errors_are_what_python_users_expect():
    assert set(ps.__all__) == {*ps._PUBLIC, "__version__"}
    for name in ps.__all__:
        assert getattr(ps, name).__doc__
        assert name in dir(ps)
    with pytest.raises(AttributeError, match="no attribute 'opne'"):
        ps.opne  # noqa: B018
    assert issubclass(ps.InvalidValueError, ValueError)
    assert issubclass(ps.NotFoundError, LookupError)
    assert issubclass(ps.StorageError, OSError)
    kinds = (ps.InvalidValueError, ps.NotFoundError, ps.StorageError)
    assert all(issubclass(kind, ps.PyroshockError) for kind in kinds)


def test_the_import_alone_loads_nothing_heavy():
    code = "import sys, pyroshock; print(*sorted(name for name in sys.modules if '.' not in name))"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert not _HEAVY & set(printed)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_typed_project_passes_mypy_strict(tmp_path):
    (tmp_path / "analysis.py").write_text(
        textwrap.dedent(
            """
            import numpy as np
            import pandas as pd
            import pyroshock as ps


            def analyse(folder: str) -> pd.DataFrame:
                with ps.open("sqlite:///lab.db") as store:
                    report = store.ingest(folder, progress=False)
                    steel = store.impacts(campaign=report.campaign, where="tip_material = steel")
                    force: pd.Series[float] = store.recording(12)["force"].between(0.0, 0.1)
                    spectrum: pd.Series[float] = ps.srs(np.asarray(force), 50_000.0)
                    runs = store.train(store.dataset("spring", campaigns=[report.campaign]), models=["tree"])
                    decision = store.promote(runs.labels[0], reason="first")
                    assert decision.promoted and len(spectrum) > 0
                    shot = store.twin(campaign=report.campaign).predict(tank_pressure="5 bar", bullet_mass=0.5)
                    print(float(shot.velocity), shot.force.to_frame(), shot.srs.mean.max())
                    diagnosis = store.diagnose(report.campaign)
                    twin = store.twin(campaign=report.campaign).with_effects(diagnosis)
                    tuned = twin.tune("spec.csv", tolerance="6 dB", bullet_mass=[0.5])
                    print(tuned.to_frame(), diagnosis.effects, twin.predict_many(steel, jobs=2).attrs["units"])
                    print(store.validate(report.campaign).scores, store.adopt(diagnosis).version)
                    return steel


            def wrong() -> None:
                ps.shipped_twin().predict("5 bar")
            """
        ),
        encoding="utf-8",
    )
    packages = tmp_path / "packages"  # the folder of a clone may have any name
    packages.mkdir()
    (packages / "pyroshock").symlink_to(Path(ps.__file__).parent)
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file=", "--follow-imports=silent", "analysis.py"]
    done = subprocess.run(
        command, cwd=tmp_path, capture_output=True, text=True, check=False, env={"MYPYPATH": str(packages), "PATH": ""}
    )
    errors = [line for line in done.stdout.splitlines() if "error" in line and line.startswith("analysis.py")]
    assert len(errors) == 1 and "Too many positional arguments" in errors[0], done.stdout
