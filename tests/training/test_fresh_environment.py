"""A registered model predicts where nothing but its own requirements is installed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import urllib.request
import venv
from pathlib import Path

import numpy as np
import pytest
from pyroshock.training.fitting.fitting import fit_task, task_of
from pyroshock.training.models.serialization import unpack
from support.records.pulse_tables import frame_of_inputs
from support.stores.registries import context_in, fresh_registry, without_figures

ROOT = Path(__file__).resolve().parents[2]
MODEL = "tree"  # of a kind that needs a library beside numpy and scipy

PREDICT = """
import json, sys, importlib.util
import mlflow, pandas
store, uri, table, answer = sys.argv[1:]
mlflow.set_tracking_uri(store)
table = pandas.DataFrame(json.load(open(table)))
json.dump(mlflow.pyfunc.load_model(uri).predict(table).to_dict("list"), open(answer, "w"))
libraries = ("torch", "gpytorch", "optuna")
print(json.dumps([name for name in libraries if importlib.util.find_spec(name)]))
"""


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_champion_predicts_the_same_in_a_fresh_environment(tmp_path, monkeypatch):
    _need_the_index()
    without_figures(monkeypatch)
    registry = fresh_registry(tmp_path)
    context = context_in(registry)
    made = fit_task(task_of(MODEL, "repetitions", context), context)
    registry.set_champion(registry.record(made))
    inputs = context.table.take(np.arange(0, len(context.table), 30)).inputs
    (tmp_path / "table.json").write_text(json.dumps(frame_of_inputs(inputs).to_dict("list")))
    with registry.connection.client():
        import mlflow

        requirements = mlflow.artifacts.download_artifacts(
            artifact_uri=f"models:/{MODEL}@champion/requirements.txt",
            dst_path=str(tmp_path / "model"),
        )
    _run(
        sys.executable,
        "-m",
        "pip",
        "wheel",
        str(ROOT),
        "--no-deps",
        "-q",
        "-w",
        str(tmp_path / "wheels"),
    )
    venv.create(tmp_path / "env", with_pip=True)
    python = str(tmp_path / "env" / "bin" / "python")
    constraints = (
        "-c",
        str(ROOT / "constraints.txt"),
    )  # as of today, whatever the index has tomorrow
    _run(
        python,
        "-m",
        "pip",
        "install",
        "-q",
        "-f",
        str(tmp_path / "wheels"),
        "-r",
        requirements,
        *constraints,
    )
    (tmp_path / "predict.py").write_text(PREDICT)
    answer = tmp_path / "answer.json"
    uri = f"models:/{MODEL}@champion"
    store = registry.place.tracking_uri
    output = _run(
        python, str(tmp_path / "predict.py"), store, uri, str(tmp_path / "table.json"), str(answer)
    )
    columns = json.loads(answer.read_text())
    expected = unpack(*made.packed).predict(inputs)
    forces = np.column_stack([columns[f"force_n_{point:02}"] for point in range(1, 21)])
    np.testing.assert_array_equal(forces, expected.force_n)
    np.testing.assert_array_equal(columns["contact_time_s"], expected.contact_time_s)
    assert json.loads(output.splitlines()[-1]) == []  # what trained other kinds is not there


def _run(*command: str) -> str:
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    environment |= {"MLFLOW_DISABLE_TELEMETRY": "true", "DO_NOT_TRACK": "true"}
    done = subprocess.run(
        command, capture_output=True, text=True, env=environment, cwd="/", check=False
    )
    assert done.returncode == 0, (
        f"{' '.join(command)}\n{done.stdout[-1000:]}\n{done.stderr[-3000:]}"
    )
    return done.stdout


def _need_the_index() -> None:
    index = os.environ.get("PIP_INDEX_URL", "https://pypi.org/simple").rstrip("/")
    try:
        urllib.request.urlopen(f"{index}/pip/", timeout=10).close()
    except OSError as error:
        pytest.skip(
            f"the package index is not reached, and the environment is installed from it: {error}"
        )
