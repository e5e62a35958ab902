"""A registry behind MLflow's tracking server, and MLflow's own page on the store beside a
laboratory's."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import mlflow
import numpy as np
import pytest
from pyroshock.dataset.table import PulseTable
from pyroshock.training.estimators.base import FitReport
from pyroshock.training.fitting.fitting import fit_task, task_of
from pyroshock.training.fitting.session import train
from pyroshock.training.models.serialization import unpack
from pyroshock.training.registry.intact_models import damages
from pyroshock.training.registry.model_storage import storage_for
from pyroshock.training.registry.promotion import promote
from pyroshock.training.registry.records import Trained, Version
from pyroshock.training.registry.registry import Registry
from support.processes.tracking_servers import rest, tracking_server
from support.records.pulse_tables import PREDICTORS, frame_of_inputs, pulse_table
from support.stores.registries import context_in, fresh_registry, without_figures

REPORT = FitReport(
    {"force.kernel": "matern-5/2", "force.noise": 0.0125, "force.rank": 3},
    {"force.lengthscale": [0.5 + 0.1 * number for number in range(len(PREDICTORS))]},
    {"force.loss": [2.0 - 0.01 * step for step in range(150)]},
)


@pytest.fixture(scope="module")
def few_pulses():
    return pulse_table(np.random.default_rng(1), repetitions=2)


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """It keeps the models' files itself: who asks it needs no folder in common with it."""
    folder = tmp_path_factory.mktemp("server")
    store = ("--backend-store-uri", f"sqlite:///{folder / 'mlflow.db'}")
    with tracking_server(
        folder, "server", *store, "--serve-artifacts", "--artifacts-destination", "files"
    ) as address:
        yield address


@pytest.fixture
def remote(server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Registry:
    """A laboratory's machine: another folder, and the server's address."""
    without_figures(monkeypatch)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MLFLOW_TRACKING_URI", server)
    return Registry(
        storage_for(f"sqlite:///{tmp_path / 'lab.db'}", {"MLFLOW_TRACKING_URI": server})
    )


def test_server_trains_lists_promotes_loads_and_predicts(remote, few_pulses):
    context = context_in(remote, few_pulses)
    session = train(remote, context, ["hann", "linear"], ["repetitions"])
    assert (session.trained, session.failures) == (2, [])
    assert train(remote, context, ["hann", "linear"], ["repetitions"]).trained == 0
    by_name = {version.name: version for version in remote.versions()}
    assert by_name.keys() == {"hann", "linear"} and damages(remote, list(by_name.values())) == {}
    decision = promote(
        remote, "linear", 1, lambda _: context.table, forced=True, reason="the first"
    )
    assert decision.promoted and remote.decisions() == [decision]
    in_use = remote.champion("hammer")
    expected = fit_task(task_of("linear", "repetitions", context), context)
    inputs = context.table.take(np.arange(4)).inputs
    forces = unpack(*expected.packed).predict(inputs).force_n
    np.testing.assert_array_equal(remote.load(in_use).predict(inputs).prediction.force_n, forces)
    np.testing.assert_array_equal(remote.held_out(in_use).keys, expected.held_out.keys)
    served = mlflow.pyfunc.load_model("models:/linear@champion").predict(frame_of_inputs(inputs))
    np.testing.assert_array_equal(served.filter(regex=r"^force_n_\d\d$"), forces)


def test_server_tells_of_files_that_are_gone(remote, few_pulses, tmp_path_factory):
    context = context_in(remote, few_pulses, name="gone")
    version = remote.record(fit_task(task_of("hertz", "repetitions", context), context))
    assert remote.damage(version) is None
    for file in (tmp_path_factory.getbasetemp() / "server0").glob("files/**/model.json"):
        if '"hertz"' in file.read_text():
            file.unlink()
    assert remote.damage(version).startswith(
        "the server has no model.json of hertz@1; restore the folder"
    )


def made(registry: Registry, table: PulseTable) -> Trained:
    context = context_in(registry, table, name="searched")
    return replace(fit_task(task_of("reed", "repetitions", context), context), fit_report=REPORT)


def test_server_answers_with_what_was_searched(remote, few_pulses, server):
    session = remote.open_session(context_in(remote, few_pulses, name="searched").dataset, 0)
    check_answers(server, remote, remote.record(made(remote, few_pulses), session), session)


@pytest.mark.slow
def test_mlflow_page_on_the_store_beside_a_laboratory(few_pulses, tmp_path, monkeypatch):
    """By the command of docs/explanation/registry.md; its page asks what is asked here."""
    without_figures(monkeypatch)
    registry = fresh_registry(tmp_path)
    session = registry.open_session(context_in(registry, few_pulses).dataset, 0)
    version = registry.record(made(registry, few_pulses), session)
    registry.set_champion(version)
    options = (
        "--backend-store-uri",
        "sqlite:///lab-models.db",
        "--default-artifact-root",
        "lab-models",
    )
    with tracking_server(tmp_path, "ui", *options) as address:
        check_answers(address, registry, version, session)
        (model,) = rest(address, "registered-models/search")["registered_models"]
    assert {alias["alias"] for alias in model["aliases"]} == {"champion", "champion-hammer"}


def check_answers(address: str, registry: Registry, version: Version, session: str) -> None:
    """MLflow's page and our registry say the same of a version's settings and of the course of its
    search."""
    experiment = rest(address, "experiments/get-by-name?experiment_name=pyroshock")["experiment"][
        "experiment_id"
    ]
    query = {"experiment_ids": [experiment], "filter": "metrics.`fit.force.noise` < 0.1"}
    (run,) = rest(address, "runs/search", **query)["runs"]
    history = rest(
        address, f"metrics/get-history?run_id={version.run_id}&metric_key=fit.force.loss"
    )["metrics"]
    files = rest(address, f"artifacts/list?run_id={version.run_id}")["files"]
    parameters = {each["key"]: each["value"] for each in run["data"]["params"]}
    settings = registry.fit_settings(version)
    assert settings == REPORT.parameters([predictor.name for predictor in PREDICTORS])
    assert {name: parameters[f"fit.{name}"] for name in settings} == {
        n: str(value) for n, value in settings.items()
    }
    assert [(int(point["step"]), point["value"]) for point in history] == registry.fit_histories(
        version
    )["force.loss"]
    assert len(history) == 150
    assert {tag["key"]: tag["value"] for tag in run["data"]["tags"]}[
        "mlflow.parentRunId"
    ] == session
    datasets = [each["dataset"] for each in run["inputs"]["dataset_inputs"]]
    assert {json.loads(each["profile"])["snapshot"] for each in datasets} == {version.dataset.hash}
    assert {"held_out.npz", "code_version.json", "pulses.png"} <= {file["path"] for file in files}
