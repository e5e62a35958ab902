"""Installs locked packages into the environment of the Python that runs it:
`.venv/bin/python -m tools.install requirements/run.txt...`.

uv installs what is listed and nothing else, with the listed content (`--require-hashes --no-deps`),
as pip does, in a sixth of pip's processor time. uv itself is installed by pip, from
requirements/installer.txt. It does not read pip's configuration, so that its settings are made of
it here. Where uv cannot be had, or cannot install a file, pip installs the packages and has the
last word.
"""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_LISTED_ONLY = ("--require-hashes", "--no-deps")
#: Sections of pip's configuration, each of which counts more than the one before.
_SECTIONS = ("global", "install", ":env:")
#: pip's setting -> uv's variable, and what separates several values of it.
_VARIABLES = {
    "index-url": ("UV_DEFAULT_INDEX", " "),
    "extra-index-url": ("UV_INDEX", " "),
    "find-links": ("UV_FIND_LINKS", ","),
    "trusted-host": ("UV_INSECURE_HOST", " "),
    "default-timeout": ("UV_HTTP_TIMEOUT", " "),
    "timeout": ("UV_HTTP_TIMEOUT", " "),
    "cert": ("SSL_CERT_FILE", " "),
    "proxy": ("ALL_PROXY", " "),
}


def main(lists: list[str]) -> int:
    """Install the packages of these lists, and give the exit code of the last installer.

    Parameters:
        lists: files of `requirements/`, whose packages go into this environment.
    """
    pip = [sys.executable, "-m", "pip", "-qq"]
    without_constraints = os.environ | {"PIP_CONSTRAINT": "", "PIP_BUILD_CONSTRAINT": ""}
    uv = Path(sys.executable).with_name("uv")
    if not uv.is_file():
        # Where it cannot be had, the packages say what is wrong.
        subprocess.run(
            [*pip, "install", *_LISTED_ONLY, "-r", str(ROOT / "requirements" / "installer.txt")],
            env=without_constraints,
            capture_output=True,
            check=False,
        )
    options = [option for path in lists for option in ("-r", path)]
    if uv.is_file():
        list_settings = [sys.executable, "-m", "pip", "config", "list"]
        lines = subprocess.run(list_settings, capture_output=True, text=True, check=False).stdout
        settings = settings_of_pip(lines)
        if settings.get("no-index", "0").lower() in ("1", "true", "yes", "on"):
            options.append("--no-index")
        installation = subprocess.run(
            [uv, "-q", "pip", "install", "--python", sys.executable, *_LISTED_ONLY, *options],
            env=os.environ | variables_of_uv(settings),
            capture_output=True,
            check=False,
        )
        if installation.returncode == 0:
            return 0
    return subprocess.run(
        [*pip, "install", *_LISTED_ONLY, *options], env=without_constraints, check=False
    ).returncode


def settings_of_pip(lines: str) -> dict[str, str]:
    """pip's settings by their names.

    Parameters:
        lines: what `pip config list` prints: `section.name='value'`, a line a setting.
    """
    values: dict[tuple[str, str], str] = {}
    for line in lines.splitlines():
        key, _, value = line.partition("=")
        section, _, name = key.rpartition(".")
        if section in _SECTIONS and value:
            values[section, name] = str(ast.literal_eval(value))
    return {
        name: values[section, name]
        for section in _SECTIONS
        for place, name in values
        if place == section
    }


def variables_of_uv(settings: Mapping[str, str]) -> dict[str, str]:
    """The variables that make uv look where pip looks. uv takes a package from whichever index has
    the listed version, as pip does: its content is known by its hash, wherever it comes from.

    Parameters:
        settings: pip's settings by their names.
    """
    variables = {
        variable: separator.join(settings[name].split())
        for name, (variable, separator) in _VARIABLES.items()
        if name in settings
    }
    return {"UV_INDEX_STRATEGY": "unsafe-best-match"} | variables


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
