"""Many clients of one store at the same moment, and what they must not say."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

#: Words of errors that a second try, or a better order, would have cured.
FORBIDDEN = (
    "Traceback",
    "deadlock",
    "serializ",
    "locked",
    "IntegrityError",
    "UNIQUE",
    "duplicate key",
    "Giving up",
)

COMMANDS = (
    "pyroshock.app.doors.command_line.main",
    "pyroshock.schema.session",
    "pyroshock.ingest.load",
    "pyroshock.ingest.storing.reextraction",
)
#: PyTorch and MLflow are left to those who train: they take seconds.
MODELS = (
    "mlflow.pyfunc",
    "mlflow.store.tracking.sqlalchemy_store",
    "sklearn.linear_model",
    "matplotlib.figure",
)

Command = Sequence[str | Path]


@dataclass(frozen=True)
class Said:
    """How one command of one client ended."""

    words: list[str]
    code: int
    seconds: float
    out: str
    err: str

    @property
    def complaint(self) -> str | None:
        """What is wrong with it; None for a command that did what it was asked."""
        wrong = [word for word in FORBIDDEN if word.lower() in (self.out + self.err).lower()]
        if self.code == 0 and not wrong:
            return None
        return f"{' '.join(self.words)}: exit {self.code}, {wrong}: {self.err[-2000:]}"


def together(
    folder: Path,
    clients: Sequence[Sequence[Command]],
    *,
    modules: Sequence[str] = COMMANDS,
    environment: Mapping[str, str] | None = None,
    timeout_s: float = 100.0,
) -> list[list[Said]]:
    """Each client runs its commands one after the other, all clients at once; what each command
    said."""
    folder.mkdir(parents=True)
    asked = {
        "modules": list(modules),
        "clients": [[[str(w) for w in words] for words in one] for one in clients],
    }
    (folder / "clients.json").write_text(json.dumps(asked), encoding="utf-8")
    driver = [
        sys.executable,
        "-W",
        "ignore::DeprecationWarning",
        Path(__file__).with_name("crowd_driver.py"),
        folder,
    ]
    settings = {
        **os.environ,
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
        **(environment or {}),
    }
    running = subprocess.Popen(
        driver, env=settings, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    try:
        error = running.communicate(timeout=timeout_s)[1]
    except BaseException:  # an interruption, too, ends the processes; it is raised again
        os.killpg(running.pid, signal.SIGKILL)  # the clients too, who would go on alone
        running.communicate()
        raise
    assert running.returncode == 0, error
    return [
        [_said(folder / f"{i}-{j}.json") for j in range(len(one))] for i, one in enumerate(clients)
    ]


def _said(file: Path) -> Said:
    return Said(**json.loads(file.read_text(encoding="utf-8")))


def complaints(said: Sequence[Sequence[Said]]) -> list[str]:
    """Of all that the clients ran."""
    return [each.complaint for one in said for each in one if each.complaint is not None]
