"""Who may do the work, and what is said of those who cannot."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from pyroshock.parallel import cluster, executor
from pyroshock.parallel.executor import ExecutorConfig

NOBODY = "tcp://127.0.0.1:9"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"backend": "slurm"}, "backend 'slurm'; expected one of local, dask"),
        ({"jobs": 0}, "jobs = 0; expected 1 or more"),
        ({"backend": "dask"}, "--scheduler tcp://HOST:8786"),
        ({"scheduler": "tcp://lab:8786"}, "--backend dask"),
    ],
)
def test_what_is_no_crew_is_refused(arguments, said):
    with pytest.raises(ValueError, match=said):
        ExecutorConfig(**arguments)


def test_missing_library_is_named_with_its_cure(monkeypatch):
    monkeypatch.setattr(executor, "find_spec", lambda _: None)
    with pytest.raises(ValueError, match=r"needs distributed.*pip install 'pyroshock\[cluster\]'"):
        ExecutorConfig("dask", scheduler=NOBODY)


def test_scheduler_that_does_not_answer_is_named(monkeypatch):
    pytest.importorskip("distributed", reason="no Dask: it comes with pyroshock[cluster]")
    monkeypatch.setattr(cluster, "WAIT_S", 0.5)
    with pytest.raises(ValueError, match=f"no Dask scheduler answers at {NOBODY}"):
        ExecutorConfig("dask", scheduler=NOBODY).check()


def test_workers_with_other_software_are_refused():
    """They would give other results, and nobody would know."""

    def versions(here, there):
        client = {"packages": {"pyroshock": here}}
        workers = {"tcp://lab-2:4711": {"packages": {"pyroshock": there}}}
        return lambda packages: {"client": client, "workers": workers}

    for found in ("0.0.9", None):
        client = SimpleNamespace(wait_for_workers=lambda *_, **__: None, get_versions=versions("0.1.0", found))
        with pytest.raises(ValueError, match=f"lab-2:4711 has pyroshock {found}, here it is 0.1.0"):
            cluster._check_workers(client, NOBODY)
