"""`make lock`: the exact packages of each environment that the Makefile makes, with the SHA-256 of
all of their files.

uv resolves pyproject.toml within the versions of constraints.txt, for every platform at once, and
knows the hashes of the index. The files of requirements/ name no index, each adds to the one that
it begins with, and `tools/install.py` installs from them with `--require-hashes --no-deps`: nothing
that is not listed, and nothing with another content. `installer.txt` is uv itself.

Builds of a version that lie in the folders of PIP_FIND_LINKS (PyTorch without GPU libraries,
`2.13.0+cpu`) stand in `cpu.txt`, which the Makefile tries first: where both are to be had, pip
prefers the file whose hash the index tells.
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "requirements"
#: Environment -> the one that it adds to, and its extra.
ENVIRONMENTS: dict[str, tuple[str | None, str | None]] = {
    "run": (None, None),
    "models": ("run", "models"),
    "test": ("models", "test"),
    "fuzz": ("test", "fuzz"),
    "dev": ("test", "dev"),
}
#: The oldest Python whose packages of constraints.txt all exist.
PYTHON = "3.11.5"
#: What PyTorch's build for GPUs needs beside its CPU build, and the CPU build does not. The
#: Makefile installs it where the index gave that build.
CUDA = re.compile(r"(nvidia|cuda)-|triton$")

_NAME = re.compile(r"[A-Za-z0-9][\w.-]*")


def main() -> int:
    """Write the files of `requirements/` anew; the arguments are the program `uv`, and its version
    as a requirement."""
    uv, installer = sys.argv[1:]
    hashes_by_file: dict[str, str] = {}
    cuda: dict[str, str] = {}
    FOLDER.mkdir(exist_ok=True)
    for name, (before, extra) in ENVIRONMENTS.items():
        options = [] if extra is None else ["--extra", extra]
        # setuptools builds the project itself, in the environment.
        packages = _resolved(uv, ["pyproject.toml", "-", *options], "setuptools")
        cuda |= {package: entry for package, entry in packages.items() if CUDA.match(package)}
        own = {
            package: entry
            for package, entry in packages.items()
            if package not in hashes_by_file and package not in cuda
        }
        if name != "fuzz":  # no other environment adds to it
            hashes_by_file |= own
        _write(name, before, own)
    _write("cuda", None, cuda)
    _write("cpu", None, _builds(hashes_by_file))
    _write("installer", None, _resolved(uv, ["-"], installer))
    return 0


def _resolved(uv: str, sources: list[str], requirement: str) -> dict[str, str]:
    """Normalised name -> its entry: version, marker and hashes. `-` among the sources is the
    requirement."""
    command = [uv, "pip", "compile", *sources, "--quiet", "--universal"]
    command += ["--python-version", PYTHON, "--constraints", "constraints.txt"]
    command += ["--generate-hashes", "--no-annotate", "--no-header", "--no-emit-index-url"]
    environment = {**os.environ, "UV_NO_PROGRESS": "1"}
    environment.setdefault("SSL_CERT_FILE", os.environ.get("PIP_CERT", ""))
    done = subprocess.run(
        command,
        cwd=ROOT,
        input=f"{requirement}\n",
        capture_output=True,
        text=True,
        env=environment,
        check=False,
    )
    if done.returncode != 0:
        raise SystemExit(f"lock: uv cannot resolve {' '.join(sources)}: {done.stderr.strip()}")
    entries = re.split(r"\n(?=[A-Za-z0-9])", done.stdout.strip())
    return {_normalised(entry): entry for entry in entries}


def _normalised(requirement: str) -> str:
    match = _NAME.match(requirement)
    assert match is not None, requirement
    return re.sub(r"[-_.]+", "-", match[0]).lower()


def _builds(packages: Mapping[str, str]) -> dict[str, str]:
    """Entries of the builds of these packages in the folders of PIP_FIND_LINKS."""
    builds: dict[str, str] = {}
    for folder in os.environ.get("PIP_FIND_LINKS", "").split():
        for wheel in sorted(Path(folder).glob("*+*.whl")):
            name, version, *_ = wheel.name.split("-")
            package = _normalised(name)
            if packages.get(package, "").split()[:1] == [f"{package}=={version.partition('+')[0]}"]:
                with wheel.open("rb") as content:
                    digest = hashlib.file_digest(content, "sha256").hexdigest()
                builds[package] = (
                    builds.get(package, f"{package}=={version}")
                    + f" \\\n    --hash=sha256:{digest}"
                )
    return builds


def _write(name: str, before: str | None, packages: Mapping[str, str]) -> None:
    head = "# Made by `make lock` from pyproject.toml and constraints.txt.\n"
    base = "" if before is None else f"-r {before}.txt\n"
    text = head + base + "".join(f"{packages[package]}\n" for package in sorted(packages))
    (FOLDER / f"{name}.txt").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    raise SystemExit(main())
