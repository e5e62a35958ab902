"""Locked packages are installed with the listed content or not at all, from where pip finds
packages, with uv and without it."""

from __future__ import annotations

import hashlib
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tools.install import ROOT, settings_of_pip, variables_of_uv


def test_uv_looks_where_pip_looks() -> None:
    settings = settings_of_pip(
        ":env:.index-url='https://own.example/simple'\n"
        ":env:.disable-pip-version-check='1'\n"
        "global.index-url='https://of-all.example/simple'\n"
        "global.extra-index-url='\\nhttps://a.example/simple\\nfile:///b/simple'\n"
        "install.find-links='/wheels /more'\n"
        "global.find-links='/others'\n"
        "freeze.timeout='10'\n"
        "global.cert='/certificates.pem'\n"
        "a line that is none\n"
    )
    assert variables_of_uv(settings) == {
        "UV_DEFAULT_INDEX": "https://own.example/simple",
        "UV_INDEX": "https://a.example/simple file:///b/simple",
        "UV_FIND_LINKS": "/wheels,/more",
        "SSL_CERT_FILE": "/certificates.pem",
        "UV_INDEX_STRATEGY": "unsafe-best-match",
    }


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A package of one module, which asks for another that nobody has."""
    path = tmp_path_factory.mktemp("wheels") / "anvil_words-1.0-py3-none-any.whl"
    metadata = (
        "Metadata-Version: 2.1\nName: anvil-words\nVersion: 1.0\nRequires-Dist: no-such-one\n"
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("anvil_words.py", "WORDS = ('anvil',)\n")
        archive.writestr("anvil_words-1.0.dist-info/METADATA", metadata)
        archive.writestr(
            "anvil_words-1.0.dist-info/WHEEL",
            "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        )
        archive.writestr("anvil_words-1.0.dist-info/RECORD", "")
    return path


@pytest.mark.parametrize("installer", ["uv", "pip"])
def test_a_package_is_installed_with_the_listed_content_only(
    wheel: Path, tmp_path: Path, installer: str
) -> None:
    environment = tmp_path / "environment"
    subprocess.run([sys.executable, "-m", "venv", environment], check=True)
    python = environment / "bin" / "python"
    if installer == "uv":
        uv = Path(sys.executable).with_name("uv")
        if not uv.is_file():
            # Where the index has no uv, pip alone has installed what runs these tests.
            pytest.skip("uv is not installed beside this Python")
        (environment / "bin" / "uv").symlink_to(uv)
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()

    for listed in (digest[::-1], digest):
        packages = tmp_path / "packages.txt"
        packages.write_text(f"anvil-words==1.0 --hash=sha256:{listed}\n", encoding="utf-8")
        installation = subprocess.run(
            [python, "-m", "tools.install", packages],
            cwd=ROOT,
            env={
                "HOME": str(tmp_path),
                "PATH": "/usr/bin:/bin",
                "PIP_CONFIG_FILE": "/dev/null",
                "PIP_NO_INDEX": "1",
                "PIP_FIND_LINKS": str(wheel.parent),
            },
            capture_output=True,
            text=True,
            check=False,
        )
        records = environment.glob("lib/python*/site-packages/anvil_words-*/INSTALLER")
        installers = [path.read_text(encoding="utf-8").strip() for path in records]
        if listed == digest:
            assert installation.returncode == 0, installation.stderr
            assert installers == [installer]
        else:
            assert installation.returncode != 0
            assert "hash" in installation.stderr.lower()
            assert installers == []
