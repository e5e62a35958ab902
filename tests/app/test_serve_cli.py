"""`pyroshock serve` as a person starts it: its address, its end, and what it refuses."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from support.stores.stores import CLI, assert_whole, counts, pyroshock

#: Starting imports much, on a machine that may be busy.
PATIENCE_S = 60.0


@pytest.fixture
def db(spring_lab: Path, tmp_path: Path) -> str:
    return f"sqlite:///{shutil.copy(spring_lab / 'lab.db', tmp_path)}"


@pytest.fixture
def started(tmp_path: Path) -> Iterator[list[subprocess.Popen[str]]]:
    servers: list[subprocess.Popen[str]] = []
    yield servers
    for server in servers:
        if server.poll() is None:
            server.kill()
        server.communicate()


def serve(*words: str, cwd: Path) -> subprocess.Popen[str]:
    environment = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("PYROSHOCK", "MLFLOW"))
    }
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen([*CLI, "serve", *words], text=True, env=environment, cwd=cwd, **pipes)


def address_of(server: subprocess.Popen[str]) -> str:
    assert server.stderr is not None
    lines: list[str] = []
    reader = threading.Thread(target=lambda: lines.append(server.stderr.readline()), daemon=True)
    reader.start()
    reader.join(PATIENCE_S)
    assert lines, "nothing was printed"
    found = re.fullmatch(r"pyroshock: (http://\S+:\d+/)\n", lines[0])
    assert found is not None, lines[0]
    return found[1]


def got(address: str, headers: dict[str, str] | None = None) -> str:
    with urllib.request.urlopen(
        urllib.request.Request(address, headers=headers or {}), timeout=PATIENCE_S
    ) as answer:
        return str(answer.read().decode())


def refused(*words: str) -> str:
    """The one line of a server that does not start."""
    result = pyroshock("serve", *words)
    assert (result.exit_code, result.stdout) == (2, ""), result.stderr
    assert result.stderr.count("\n") == 1, result.stderr
    assert result.stderr.startswith("pyroshock: ")
    return result.stderr


@pytest.mark.parametrize(
    ("ending", "word"), [(signal.SIGINT, ""), (signal.SIGTERM, "a-token-of-enough-characters")]
)
def test_it_answers_who_may_ask_and_ends_when_it_is_told(
    db: str, tmp_path: Path, started, ending, word
) -> None:
    """Without a token it answers all of this machine, with one those who bring it."""
    guarded, headers = (
        ("--host", "0.0.0.0", "--token", word) if word else (),
        {"Authorization": f"Bearer {word}"},
    )
    before, server = counts(db), serve("--db", db, "--port", "0", *guarded, cwd=tmp_path)
    started.append(server)
    address = address_of(server).replace("0.0.0.0", "127.0.0.1")
    assert not address.endswith(":0/")
    if word:
        with pytest.raises(urllib.error.HTTPError, match="401"):
            got(address)
    assert [
        row["name"] for row in json.loads(got(address + "api/campaigns", headers if word else None))
    ] == ["spring"]
    assert "<h1>Laboratory</h1>" in got(address, headers if word else None)
    asked = time.monotonic()
    server.send_signal(ending)
    out, err = server.communicate(timeout=PATIENCE_S)
    assert time.monotonic() - asked < 5
    assert server.returncode in ((0, 130) if ending == signal.SIGINT else (0, -ending)), err
    assert "Traceback" not in out + err and counts(db) == before
    assert_whole(db, 1)


def test_what_keeps_it_from_starting_is_named(db: str, tmp_path: Path) -> None:
    assert "--token" in refused("--db", db, "--host", "0.0.0.0", "--port", "0")
    assert "5 characters" in refused("--db", db, "--host", "0.0.0.0", "--token", "short")
    assert "192.0.2.1" in refused(
        "--db", db, "--host", "192.0.2.1", "--token", "x" * 16, "--port", "0"
    )
    assert "nowhere" in refused("--db", f"sqlite:///{tmp_path}/nowhere/lab.db", "--port", "0")
    assert "no-data" in refused("--db", db, "--data", str(tmp_path / "no-data"))
    assert not (tmp_path / "nowhere").exists()
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        assert port in refused("--db", db, "--port", port)


def test_answers_are_sent_without_waiting_for_confirmations(
    db: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """asyncio sets TCP_NODELAY on connections whose protocol is named; without it every answer but
    the first of a connection came 40 ms late."""
    import uvicorn

    protocols: list[int] = []
    monkeypatch.setattr(
        uvicorn.Server,
        "run",
        lambda _self, sockets: protocols.extend(listener.proto for listener in sockets),
    )
    assert pyroshock("serve", "--db", db, "--port", "0").exit_code == 0
    assert protocols == [socket.IPPROTO_TCP]
