"""Runs a command as on a machine that has only Python and make: `python tools/clean_environment.py
COMMAND...`.

The home is an empty folder, no font is known, PATH holds the system's folders and this Python's
alone, and of the variables only those below are left. What then passes needs nothing that a person
has installed, set or kept. Files that live as long as a test are made in memory where there is room
for them: a disk may take forty times as long to make one.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

_SYSTEM_PATH = ("/usr/local/sbin", "/usr/local/bin", "/usr/sbin", "/usr/bin", "/sbin", "/bin")
#: How packages are reached, what the processor needs, and what the tests themselves are asked by.
_KEPT = (
    *("http_proxy", "https_proxy", "no_proxy", "HTTP_PROXY", "HTTPS_PROXY", "NO_PROXY"),
    *("SSL_CERT_FILE", "REQUESTS_CA_BUNDLE", "CI", "TMPDIR", "COVERAGE_FILE"),
    *("OPENBLAS_CORETYPE", "OPENBLAS_L2_SIZE", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"),
    *(
        "TEST_DATABASE_URL",
        "PYROSHOCK_CHROMIUM",
        "PYROSHOCK_SLOW",
        "PYROSHOCK_ROUNDS",
        "PYROSHOCK_SCREENSHOTS",
    ),
    *("PYROSHOCK_PAGE_PICTURES", "PYROSHOCK_FAULTS_KILLS", "PYROSHOCK_FAULTS_SEED"),
)
#: A file system in memory, and what must be free there: each worker's database server keeps a
#: gigabyte of log, and the tests of large recordings need theirs.
_MEMORY = Path("/dev/shm")  # noqa: S108  # names of files in it are made by `tempfile`
_ROOM = 8 * 2**30
_NO_FONTS = (
    '<?xml version="1.0"?><!DOCTYPE fontconfig SYSTEM "fonts.dtd"><fontconfig></fontconfig>\n'
)


def clean_variables(given: Mapping[str, str], home: Path) -> dict[str, str]:
    """The variables of the command. `home` is an empty folder, in which `write_settings` puts what
    they name."""
    kept = {
        name: value for name, value in given.items() if name in _KEPT or name.startswith("PIP_")
    }
    own_pip = Path(given.get("HOME", "/nonexistent")) / ".config" / "pip" / "pip.conf"
    if "PIP_CONFIG_FILE" not in kept and own_pip.is_file():
        kept["PIP_CONFIG_FILE"] = str(own_pip)  # where packages come from is the machine's to say
    if "TMPDIR" not in kept and _has_room(_MEMORY):
        kept["TMPDIR"] = str(_MEMORY)
    return kept | {
        "HOME": str(home),
        "PATH": os.pathsep.join((*_SYSTEM_PATH, str(Path(sys.executable).resolve().parent))),
        "FONTCONFIG_FILE": str(home / "fonts.conf"),
        "GIT_CONFIG_GLOBAL": os.devnull,
        "GIT_CONFIG_NOSYSTEM": "1",
        "TZ": "UTC",
    }


def _has_room(folder: Path) -> bool:
    """Whether programs may be run from files there, and enough of them."""
    if not os.access(folder, os.W_OK):
        return False
    system = os.statvfs(folder)
    return not system.f_flag & os.ST_NOEXEC and system.f_bavail * system.f_frsize >= _ROOM


def write_settings(home: Path) -> None:
    """What the variables name: a fontconfig without fonts."""
    (home / "fonts.conf").write_text(_NO_FONTS, encoding="utf-8")


def main(command: list[str]) -> int:
    """Runs the command and gives its exit code."""
    if not command:
        print("usage: python tools/clean_environment.py COMMAND...", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory(
        prefix="pyroshock-home-", ignore_cleanup_errors=True
    ) as folder:
        home = Path(folder)
        write_settings(home)
        return subprocess.run(
            command, env=clean_variables(os.environ, home), check=False
        ).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
