"""MLflow's own server, in a process of its own, for tests of what other software sees of a
registry."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

_QUIET = {
    "MLFLOW_DISABLE_TELEMETRY": "true",
    "DO_NOT_TRACK": "true",
    "MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false",
}
_STARTS_S = 120


@contextmanager
def tracking_server(folder: Path, command: str, *options: str) -> Iterator[str]:
    """`mlflow COMMAND OPTIONS` on a free port of this machine, with one worker; its address.
    `folder` has its log."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    where = ("--host", "127.0.0.1", "--port", port, "--workers", "1")
    log = folder / "server.log"
    with log.open("w") as output:
        process = subprocess.Popen(
            [sys.executable, "-m", "mlflow", command, *options, *where], env=os.environ | _QUIET,
            cwd=folder,
            stdout=output, stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip
    try:
        _wait(process, f"http://127.0.0.1:{port}/health", log)
        yield f"http://127.0.0.1:{port}"
    finally:
        os.killpg(process.pid, signal.SIGTERM)
        process.wait(30)


def rest(address: str, path: str, **body: Any) -> dict[str, Any]:
    """What MLflow's REST API answers: a POST of `body`, or a GET without one."""
    request = urllib.request.Request(
        f"{address}/api/2.0/mlflow/{path}", headers={"Content-Type": "application/json"}
    )
    request.data = json.dumps(body).encode() if body else None
    with urllib.request.urlopen(request, timeout=60) as answer:
        content: dict[str, Any] = json.load(answer)
    return content


def _wait(process: subprocess.Popen[bytes], health: str, log: Path) -> None:
    end = time.monotonic() + _STARTS_S
    while time.monotonic() < end and process.poll() is None:
        try:
            with urllib.request.urlopen(health, timeout=5):
                return
        except OSError:
            time.sleep(0.1)
    raise RuntimeError(f"MLflow's server does not answer at {health}:\n{log.read_text()[-2000:]}")
