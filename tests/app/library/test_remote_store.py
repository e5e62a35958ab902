"""The library with the address of a server: the same methods, results and words as beside the
store; and servers that are gone, are others, or mean harm."""

from __future__ import annotations

import http.server
import json
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyroshock as ps
import pytest
from pyroshock.app.library import server_connection
from pyroshock.app.library.remote_store import RemoteStore
from support.processes.browsers import served, until
from support.records.campaigns import hammer_campaign
from support.stores.registries import at_its_place
from support.stores.web_stores import DATASET, GUN, HAMMER, PLAN, filled_lab, quick_plates

__all__ = ["filled_lab", "quick_plates"]

TOKEN = "a-token-of-the-laboratory"
Pair = tuple[ps.ExperimentStore, ps.ExperimentStore]


@pytest.fixture(scope="module")
def lab(
    filled_lab: Path, quick_plates: None, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Any]:
    """A served copy of the filled store."""
    from pyroshock.training.registry.model_storage import storage_for
    from pyroshock.training.registry.registry import Registry

    folder = tmp_path_factory.mktemp("remote") / "lab"
    shutil.copytree(filled_lab, folder)
    url = f"sqlite:///{folder}/lab.db"
    at_its_place(Registry(storage_for(url, {})))
    with served(url, folder, token=TOKEN) as lab:
        yield lab


@pytest.fixture(scope="module")
def pair(lab: Any) -> Iterator[Pair]:
    """The same store, by its own address and behind the server."""
    with ps.open(lab.db) as local, ps.open(lab.origin, token=TOKEN) as remote:
        yield local, remote


def connection_of(store: Any) -> Any:
    return store.answers.connection


def outcome(call: Callable[[ps.ExperimentStore], Any], store: ps.ExperimentStore) -> Any:
    try:
        return call(store)
    except ps.PyroshockError as error:
        return type(error), str(error)


def assert_same(local: Any, remote: Any) -> None:
    if isinstance(local, pd.DataFrame):
        pd.testing.assert_frame_equal(remote, local)
        assert remote.attrs == local.attrs
    elif isinstance(local, pd.Series):
        pd.testing.assert_series_equal(remote, local)
        assert remote.attrs == local.attrs
    elif isinstance(local, np.ndarray):
        np.testing.assert_array_equal(remote, local, strict=True)
    else:
        assert remote == local


CALLS: dict[str, Callable[[ps.ExperimentStore], Any]] = {
    "campaigns": lambda s: s.campaigns(),
    "impacts": lambda s: s.impacts(),
    "impacts chosen": lambda s: s.impacts(
        campaign=HAMMER, where="peak_force_n > 1", sort="-peak_force_n", limit=3,
        columns=["id", "tip_material", "peak_force_n"],
    ),
    "impacts, no condition": lambda s: s.impacts(where="tip_material ~ steel"),
    "impacts, no field": lambda s: s.impacts(where="colour = red"),
    "impacts, no campaign": lambda s: s.impacts(campaign="none"),
    "impacts, no column": lambda s: s.impacts(columns=["colour"]),
    "impacts, limit": lambda s: s.impacts(limit=0),
    "shots": lambda s: s.shots(),
    "shots chosen": lambda s: s.shots(campaign=GUN, where=["tank_pressure_pa > 1"], limit=2),
    "pulse": lambda s: s.pulse(1).to_frame(),
    "pulse figures": lambda s: dict(s.pulse(1).figures),
    "pulse, none": lambda s: s.pulse(10_000),
    "pulse, no number": lambda s: s.pulse("a"),
    "recording": lambda s: s.recording(1).to_frame(),
    "recording, none": lambda s: s.recording(10_000),
    "recording, no channel": lambda s: s.recording(1)["colour"],
    "samples": lambda s: next(iter(s.recording(1).values())).values,
    "slice": lambda s: next(iter(s.recording(1).values()))[5:9],
    "last samples": lambda s: next(iter(s.recording(1).values()))[-3:],
    "no samples": lambda s: next(iter(s.recording(1).values()))[9:9],
    "between": lambda s: next(iter(s.recording(1).values())).between(0.0, 0.01),
    "datasets": lambda s: s.datasets(),
    "dataset": lambda s: s.dataset(DATASET).to_frame(),
    "dataset hash": lambda s: s.dataset(DATASET).hash,
    "dataset, none": lambda s: s.dataset("none"),
    "models": lambda s: s.models(),
    "models chosen": lambda s: s.models(dataset=DATASET, split="repetitions"),
    "model": lambda s: repr(s.model("linear@1")),
    "model columns": lambda s: s.model("tree@1").columns,
    "model, none": lambda s: s.model("none@1"),
    "pulses of a model": lambda s: s.model("linear@1")
    .predict(s.dataset(DATASET).to_frame()).to_frame(),
    "model, no column": lambda s: s.model("linear@1").predict(pd.DataFrame({"a": [1]})),
    "compare": lambda s: s.compare("linear@1", "tree@1").to_frame(),
    "compare words": lambda s: repr(s.compare("linear@1", "tree@1", metric="all")),
    "compare figure": lambda s: s.compare("linear@1", "tree@1").figure().title,
    "compare, one": lambda s: s.compare("linear@1"),
    "diagnoses": lambda s: s.diagnoses(),
    "diagnoses, no campaign": lambda s: s.diagnoses(campaign="none"),
    "diagnosis": lambda s: repr(s.diagnosis(1)),
    "diagnosis tables": lambda s: s.diagnosis(1).effects,
    "diagnosis fits": lambda s: s.diagnosis(1).fitted,
    "diagnosis, none": lambda s: s.diagnosis(99),
    "plans": lambda s: s.plan.list(),
    "plan": lambda s: s.plan.open(PLAN).to_frame(),
    "plan quality": lambda s: s.plan.open(PLAN).quality().to_frame(),
    "plan sheet": lambda s: s.plan.open(PLAN).sheet(),
    "plan, none": lambda s: s.plan.open("none"),
    "query": lambda s: s.query("select name, density_kg_m3 from materials"),
    "query bound": lambda s: s.query(
        "select name from materials where name = :n", parameters={"n": "steel"}
    ),
    "query, writes": lambda s: s.query("delete from materials"),
    "materials": lambda s: s.materials(),
    "jobs": lambda s: s.jobs(),
    "job, none": lambda s: s.job(9_999),
    "plugins": lambda s: s.plugins(),
    "twin": lambda s: repr(s.twin(campaign=GUN)),
    "twin notes": lambda s: (s.twin(campaign=GUN).notes, s.twin(campaign=GUN).sensors),
    "twin, no campaign": lambda s: s.twin(campaign="none"),
    "twin, no effect": lambda s: s.twin(campaign=GUN, effects="gun.none"),
    "prediction": lambda s: s.twin(campaign=GUN).predict(tank_pressure="5 bar", draws=4).to_frame(),
    "spectra": lambda s: s.twin(campaign=GUN, frequencies="100:400:3")
    .predict(draws=4).srs.to_frame(),
    "prediction words": lambda s: repr(s.twin(campaign=GUN).predict(velocity="8 m/s", draws=4)),
    "prediction, two": lambda s: s.twin(campaign=GUN).predict(tank_pressure=5e5, velocity=3.0),
    "prediction, no tip": lambda s: s.twin(campaign=GUN).predict(tip="gold"),
    "predictions": lambda s: s.twin(campaign=GUN).predict_many(
        pd.DataFrame({"tank_pressure": ["5 bar", "3 bar"], "run": [4, 5]}), draws=2, progress=False
    ),
    "predictions of runs": lambda s: s.twin(campaign=GUN).predict_many(
        pd.DataFrame({"run": [1], "tank_pressure_bar": [4.0], "bullet_mass_kg": [0.5]}),
        draws=2, progress=False,
    ),
    "predictions, no pressure": lambda s: s.twin(campaign=GUN).predict_many(
        pd.DataFrame({"bullet_mass_kg": [0.5]}), progress=False
    ),
    "with an effect": lambda s: s.twin(campaign=GUN).with_effects("plate.damping:factor=2")
    .predict(draws=0).to_frame(),
    "prediction of a diagnosis": lambda s: s.twin(campaign=GUN)
    .with_effects(next(iter(s.diagnosis(1).fitted.values()))).predict(draws=0).to_frame(),
}  # fmt: skip


@pytest.mark.parametrize("name", CALLS)
def test_what_is_read_of_a_server_is_what_is_read_beside_the_store(pair: Pair, name: str) -> None:
    local, remote = (outcome(CALLS[name], store) for store in pair)
    assert_same(local, remote)


def test_every_public_method_is_there_with_the_same_arguments() -> None:
    import inspect

    for name, method in vars(ps.ExperimentStore).items():
        if name.startswith("_") or not callable(method) or name not in vars(RemoteStore):
            continue
        own = inspect.signature(vars(RemoteStore)[name])
        assert own.parameters == inspect.signature(method).parameters, name


# --- jobs


def test_a_plan_is_made_as_a_job_and_comes_back_whole(pair: Pair) -> None:
    local, remote = pair
    made = remote.plan.factorial("by-job", kind="hammer", repetitions=1, seed=2, progress=False)
    assert_same(local.plan.open("by-job").to_frame(), made.to_frame())
    with pytest.raises(ps.InvalidValueError) as refusal:
        remote.plan.factorial("by-job", kind="hammer", progress=False)
    assert (
        str(refusal.value)
        == outcome(lambda s: s.plan.factorial("by-job", kind="hammer", progress=False), local)[1]
    )


def test_a_value_out_of_its_bounds_is_refused_in_the_same_words(pair: Pair) -> None:
    local, remote = (
        outcome(lambda s: s.plan.lhs("x", runs=0, progress=False), store) for store in pair
    )
    assert local == remote
    assert local[0] is ps.InvalidValueError and "runs is 0" in local[1]


def test_what_only_a_network_refuses_is_said_with_the_name_of_the_argument(pair: Pair) -> None:
    with pytest.raises(ps.InvalidValueError, match=r"^draws is 5000; expected at most 1,024"):
        pair[1].twin(campaign=GUN).predict(draws=5000)


def test_a_job_goes_on_without_who_asked_for_it(pair: Pair) -> None:
    _, remote = pair
    job = remote.plan.factorial("alone", kind="hammer", wait=False)
    assert "'alone'" in repr(remote.job(job.number).result(progress=False))
    assert job.state == "done"
    assert job.view.label == "Plan alone"


def test_a_job_of_this_machine_has_the_same_handle(tmp_path: Path) -> None:
    with ps.open(f"sqlite:///{tmp_path}/lab.db") as store:
        job = store.plan.factorial("here", kind="hammer", wait=False)
        assert job.state == "waiting"
        with pytest.raises(ps.StorageError, match="has not ended after 0 s; it goes on"):
            job.result(timeout_s=0, progress=False)
        job.cancel()
        assert job.state == "stopped"
        with pytest.raises(ps.PyroshockError, match="was stopped"):
            job.result(progress=False)


@pytest.mark.parametrize("kind", [LookupError, ValueError, OSError])
def test_a_job_that_fails_raises_what_the_work_raises_beside_the_store(
    pair: Pair, kind: type[Exception]
) -> None:
    from pyroshock.app.operations.plan.make import PLAN

    def fails(*_: Any) -> Any:
        raise kind("no bench; use --tank-pressure")

    run = PLAN.run
    object.__setattr__(PLAN, "run", fails)
    try:
        local, remote = (
            outcome(lambda s: s.plan.factorial("bad", kind="hammer", progress=False), store)
            for store in pair
        )
    finally:
        object.__setattr__(PLAN, "run", run)
    assert local == remote
    assert issubclass(local[0], kind) and local[1] == "no bench; use tank_pressure"


def test_a_folder_of_this_machine_is_sent(pair: Pair, tmp_path: Path) -> None:
    _, remote = pair
    report = remote.ingest(str(hammer_campaign(tmp_path / "sent", 2, 1, "sent")), progress=False)
    assert "added 2 recordings" in repr(report)
    assert remote.impacts(campaign="sent").shape[0] == 2


def test_a_folder_of_nobody_is_refused_as_the_server_refuses_it(pair: Pair) -> None:
    with pytest.raises(ps.InvalidValueError, match="no campaign folder"):
        pair[1].ingest("/no/such/folder", progress=False)


def test_what_stays_on_the_server_says_so(pair: Pair) -> None:
    _, remote = pair
    with pytest.raises(AttributeError, match="the server's alone"):
        remote.store  # noqa: B018  the property itself is refused
    with pytest.raises(AttributeError, match="built on http"):
        remote.twin(campaign=GUN).built  # noqa: B018  the property itself is refused


# --- the server is another, or gone


def test_the_token_is_shown_by_nothing(lab: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYROSHOCK_TOKEN", TOKEN)
    with ps.open(lab.origin) as remote:
        shown = repr(remote) + repr(vars(remote)) + repr(connection_of(remote))
    monkeypatch.setenv("PYROSHOCK_TOKEN", "another-token-of-nobody")
    with pytest.raises(ps.StorageError, match=r"admits nobody with this token.*token=") as error:
        ps.open(lab.origin)
    assert TOKEN not in shown and "another-token" not in f"{error.getrepr(style='long')}".replace(
        'setenv("PYROSHOCK_TOKEN", "another-token-of-nobody")', ""
    )


def test_a_server_with_a_token_asks_for_it(lab: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYROSHOCK_TOKEN", raising=False)
    with pytest.raises(ps.StorageError, match=r"needs a token: ps.open\("):
        ps.open(lab.origin)
    with ps.open(f"{lab.origin}/?token={TOKEN}") as store:
        assert store.url == lab.origin


@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("http://", "no address of a server"),
        ("http://lab:port", "no address"),
        ("http://user:word@lab", "as token="),
        ("http://lab/under/here", "a path"),
        ("http://lab?db=1", "has a query"),
    ],
)
def test_an_address_that_is_none_is_refused(address: str, words: str) -> None:
    with pytest.raises(ps.InvalidValueError, match=words) as error:
        ps.open(address)
    assert "word" not in str(error.value)


@pytest.mark.parametrize("token", ["a\r\nHost: evil", "schlüssel", "a b"])
def test_a_token_that_no_header_takes_is_refused(token: str) -> None:
    with pytest.raises(ps.InvalidValueError, match="token has a character") as error:
        ps.open("http://127.0.0.1:1", token=token)
    assert token not in str(error.value)


def test_a_token_is_for_a_server(tmp_path: Path) -> None:
    with pytest.raises(ps.InvalidValueError, match="token is for a server"):
        ps.open(f"sqlite:///{tmp_path}/lab.db", token=TOKEN)


def test_nobody_at_the_address_is_told_plainly() -> None:
    with closing(socket.socket()) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(ps.StorageError, match=f"http://127.0.0.1:{port} does not answer: nothing"):
        ps.open(f"http://127.0.0.1:{port}")
    with pytest.raises(ps.StorageError, match="no machine of this name is known"):
        ps.open("http://no-such-machine.invalid")


class Answer:
    """What a server of a test answers to everything."""

    def __init__(self, content: bytes, kind: str = "application/json", status: int = 200) -> None:
        self.content, self.kind, self.status = content, kind, status
        self.asked: list[tuple[str, str]] = []


@contextmanager
def answering(answer: Answer) -> Iterator[str]:
    """The address of a server that gives the same answer to every request."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            answer.asked.append((self.command, self.path))
            content = answer.content
            if self.path == "/api/library":
                content = b'{"software": "0.1.0", "result": null}'
            status = 200 if self.path == "/api/library" else answer.status
            self.send_response(status)
            kind = "application/json" if self.path == "/api/library" else answer.kind
            self.send_header("content-type", kind)
            self.send_header("content-length", str(len(content)))
            self.send_header("location", "http://127.0.0.1:9/sign-in")
            self.end_headers()
            self.wfile.write(content)

        do_POST = do_GET

        def log_message(self, *_: Any) -> None:
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()
        server.server_close()


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (Answer(b"<html>Sign in</html>", "text/html"), "a page"),
        (Answer(b"", "text/html", 302), "a redirect"),
        (Answer(b"<html>Bad gateway</html>", "text/html", 502), "a page .*502"),
        (Answer(b"hello"), "no JSON"),
        (Answer(b"[" * 100_000), "no JSON"),
        (Answer(b"[]"), "no result of this library"),
        (Answer(b'{"detail": "Not Found"}', status=404), "Another version"),
        (Answer(b'{"colour": 1}', status=400), "without words"),
        (
            Answer(b'{"software": "9.0", "result": {"~": "record", "type": "a:b", "fields": {}}}'),
            "has pyroshock 9.0, this is .*the same version",
        ),
        (Answer(b'{"software": "0.1.0", "result": 3}'), "no result|something else"),
    ],
    ids=lambda value: "" if isinstance(value, str) else value.content[:20].decode(),
)
def test_what_is_no_answer_of_a_server_is_told_plainly(
    answer: Answer, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(server_connection, "_PAUSES_S", (0.0, 0.0))
    with (
        answering(answer) as address,
        ps.open(address) as store,
        pytest.raises(ps.StorageError, match=words),
    ):
        store.materials()


def test_an_answer_without_end_is_not_read_to_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_connection, "MOST_BYTES", 1000)
    with (
        answering(Answer(b"x" * 5000)) as address,
        ps.open(address) as store,
        pytest.raises(ps.StorageError, match="more than 1,000 bytes"),
    ):
        store.campaigns()


def test_a_read_is_asked_again_and_a_write_is_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_connection, "_PAUSES_S", (0.0, 0.0))
    busy = Answer(b'{"detail": "busy"}', status=503)
    with answering(busy) as address, ps.open(address) as store:
        busy.asked.clear()
        with pytest.raises(ps.StorageError, match="busy"):
            store.materials()
        assert [path for _, path in busy.asked] == 3 * ["/api/materials"]
        connection_of(store)._session["csrf"] = "a"
        busy.asked.clear()
        with pytest.raises(ps.StorageError, match="busy"):
            store.plan.factorial("x", kind="hammer", wait=False)
        assert busy.asked == [("POST", "/api/plans")]


@pytest.mark.parametrize(
    "content",
    [
        b"\x93NUMPY\x01\x00v\x00{'descr': '|O', 'fortran_order': False, 'shape': (1,), }"
        + b" " * 58 + b"\n\x80\x04K\x01.",
        b"\x80\x04\x95",
        b"",
        b"\x93NUMPY\x01\x00v\x00{'descr': '<f8', 'fortran_order': False, 'shape': (9,), }"
        + b" " * 58 + b"\n",
    ],
)  # fmt: skip
def test_samples_are_numbers_and_nothing_else(content: bytes) -> None:
    with (
        answering(Answer(content, "application/octet-stream")) as address,
        ps.open(address) as store,
        pytest.raises(ps.StorageError, match=r"no array of numbers|has sent"),
    ):
        store._samples(1, 0, 1)  # type: ignore[attr-defined]  # of the remote store alone


def test_a_plan_of_a_server_writes_no_file_but_the_one_that_is_named(
    pair: Pair, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for call in ("plan", "plan sheet", "diagnosis", "compare", "prediction", "samples"):
        outcome(CALLS[call], pair[1])
    assert list(tmp_path.iterdir()) == []


# --- a server that is killed while a job is waited for


SERVE = "import sys; from pyroshock.app.doors.command_line.main import main; main()"


@pytest.mark.slow
def test_a_job_is_waited_for_while_its_server_is_killed_and_started_anew(tmp_path: Path) -> None:
    with closing(socket.socket()) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    db = f"sqlite:///{tmp_path}/lab.db"
    ps.open(db).close()
    command = [sys.executable, "-c", SERVE, "serve", "--db", db, "--port", str(port)]

    def start(*more: str) -> subprocess.Popen[bytes]:
        server = subprocess.Popen([*command, *more], stderr=subprocess.DEVNULL, cwd=tmp_path)
        until(lambda: _listens(port), 60)
        return server

    server = start("--no-worker")  # the job waits until the second server works
    try:
        store = ps.open(f"http://127.0.0.1:{port}")
        job = store.plan.factorial("survives", kind="hammer", wait=False)
        results: list[Any] = []
        waiting = threading.Thread(target=lambda: results.append(job.result(progress=False)))
        waiting.start()
        server.kill()
        server.wait()
        time.sleep(1.0)
        server = start()
        waiting.join(90)
        assert [result.name for result in results] == ["survives"]
        # the token of a write is the old server's: the new one refuses it, and another is fetched
        assert store.plan.factorial("after", kind="hammer", progress=False).name == "after"
    finally:
        server.kill()
        server.wait()


def _listens(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), 1).close()
    except OSError:  # nobody listens
        return False
    return True


def test_a_session_that_a_server_has_forgotten_is_renewed(lab: Any) -> None:
    with ps.open(lab.origin, token=TOKEN) as store:
        connection_of(store)._session.update(csrf="f" * 64, cookie="pyroshock_session=gone")
        assert len(store.query("select name from materials limit 1")) == 1


# --- types


SCRIPT = """
import pyroshock as ps

store = ps.open({address!r})
reveal_type(store)
reveal_type(store.impacts())
reveal_type(store.pulse(1))
reveal_type(store.diagnosis(1))
reveal_type(store.twin().predict())
reveal_type(store.validate("a"))
reveal_type(store.validate("a", wait=False))
reveal_type(store.validate("a", wait=False).result())
"""


@pytest.mark.slow
def test_types_are_the_same_here_and_there(tmp_path: Path) -> None:
    from mypy import api

    revealed = []
    for number, address in enumerate(("sqlite:///lab.db", "http://lab:8000")):
        script = tmp_path / f"script{number}.py"
        script.write_text(SCRIPT.format(address=address))
        out, err, code = api.run(["--config-file", "pyproject.toml", str(script)])
        assert code == 0, out + err
        revealed.append(
            [line.partition(": note: ")[2] for line in out.splitlines() if "note" in line]
        )
    assert revealed[0] == revealed[1]
    for line, word in zip(
        revealed[0][-3:], ("TwinValidation", "JobHandle", "TwinValidation"), strict=True
    ):
        assert word in line


def test_a_bound_of_the_json_is_no_text(pair: Pair) -> None:
    """A list of one text with a comma stays one text on its way."""
    from pyroshock.app.library.server_answers import query_of
    from pyroshock.app.operations.faults import read
    from pyroshock.app.operations.train.compare import Comparing

    query = query_of(read(Comparing, {"version": ["a,b"], "metric": "all"}, "python"))
    assert json.loads(json.dumps(query)) == {"version": ["a,b", ""], "metric": "all"}
