"""What a command sees in a clean environment, and that no test takes more from the machine than it
may."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from support import missing

from tools import clean_environment

ROOT = Path(__file__).resolve().parents[2]
#: Where it is decided what tests may lack.
MECHANISM = ROOT / "tests" / "support" / "missing.py"


def run_clean(*command: str, **variables: str) -> str:
    program = [sys.executable, str(ROOT / "tools" / "clean_environment.py"), *command]
    return subprocess.run(program, env=variables, capture_output=True, text=True, check=True).stdout


def test_home_is_empty_and_variables_are_gone(tmp_path: Path) -> None:
    (tmp_path / "marker").touch()
    script = (
        "import json, os; print(json.dumps([dict(os.environ), "
        "os.listdir(os.path.expanduser('~'))]))"
    )
    variables_before = {
        "HOME": str(tmp_path),
        "PATH": "/opt/x",
        "PYROSHOCK_DB": "lab.db",
        "LANG": "de_DE.UTF-8",
        "EDITOR": "x",
    }
    variables, home = json.loads(run_clean(sys.executable, "-c", script, **variables_before))
    assert (
        home == ["fonts.conf"]
        and variables["HOME"] != str(tmp_path)
        and "/opt/x" not in variables["PATH"]
    )
    assert not {"PYROSHOCK_DB", "LANG", "EDITOR", "PYTHONPATH"} & variables.keys()
    assert not Path(variables["HOME"]).exists(), "the home is removed afterwards"


def test_what_reaches_packages_and_what_tests_are_asked_by_is_kept(tmp_path: Path) -> None:
    variables_before = {
        "PIP_INDEX_URL": "x",
        "https_proxy": "y",
        "TEST_DATABASE_URL": "z",
        "CI": "true",
    }
    assert (
        variables_before.items()
        <= clean_environment.clean_variables(variables_before, tmp_path).items()
    )


def test_files_of_tests_are_in_memory_where_it_has_room_and_nobody_says_otherwise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(clean_environment, "_MEMORY", tmp_path)
    for room, expected in ((1, str(tmp_path)), (2**62, None)):
        monkeypatch.setattr(clean_environment, "_ROOM", room)
        assert clean_environment.clean_variables({}, tmp_path).get("TMPDIR") == expected
    monkeypatch.setattr(clean_environment, "_MEMORY", tmp_path / "nowhere")
    assert "TMPDIR" not in clean_environment.clean_variables({}, tmp_path)
    variables = clean_environment.clean_variables({"TMPDIR": "/var/tmp"}, tmp_path)
    assert variables["TMPDIR"] == "/var/tmp"


def test_pip_still_reads_where_packages_come_from(tmp_path: Path) -> None:
    settings = tmp_path / ".config" / "pip" / "pip.conf"
    assert "PIP_CONFIG_FILE" not in clean_environment.clean_variables(
        {"HOME": str(tmp_path)}, tmp_path
    )
    settings.parent.mkdir(parents=True)
    settings.touch()
    assert clean_environment.clean_variables({"HOME": str(tmp_path)}, tmp_path)[
        "PIP_CONFIG_FILE"
    ] == str(settings)


def test_the_exit_code_is_that_of_the_command() -> None:
    assert clean_environment.main([sys.executable, "-c", "raise SystemExit(7)"]) == 7
    assert clean_environment.main([]) == 2


def test_reports_and_charts_find_their_fonts_without_any_of_the_machine() -> None:
    script = """
from pyroshock.app.documents.document import Document
from pyroshock.app.documents.write import report_content
from pyroshock.app.figures.matplotlib_renderer import new_figure
figure = new_figure(2, 2)
figure.subplots().set_title("Größe µ, Δοκιμή, удар")
figure.canvas.draw()
print(report_content(Document("Campaign", "冲击 衝撃 충격", "", {}, []), ".pdf")[:4].decode())
"""
    assert run_clean(sys.executable, "-W", "error", "-c", script).strip() == "%PDF"


def test_a_missing_shell_browser_or_server_skips_and_is_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("PATH", "/nonexistent")
    reasons = []
    for name in ("zsh", "zsh", "chromium"):
        with pytest.raises(pytest.skip.Exception) as skipped:
            missing.needs_program(name)
        reasons.append(str(skipped.value))
    assert (
        missing.summary_of([*reasons, "not for this engine"])
        == "3 tests skipped for want of: chromium (1), zsh (2)"
    )
    assert missing.summary_of(["not for this engine"]) == ""
    assert missing.summary_of(reasons[:1]).startswith("1 test skipped")


def test_any_other_missing_program_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "/nonexistent")
    with pytest.raises(pytest.fail.Exception, match=r"pdftotext is missing.*Python package"):
        missing.needs_program("pdftotext")


def test_a_program_that_is_there_is_found() -> None:
    assert Path(missing.needs_program("no-shell-of-this-name", "sh")).name == "sh"


def _names(tree: ast.AST) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.ImportFrom):
            yield from (alias.name for alias in node.names)


def test_no_other_test_decides_what_may_be_missing() -> None:
    """A program is looked for by `support.missing` alone, and what is installed with the tests is
    simply imported."""
    forbidden = {"which", "importorskip", "findSystemFonts"}
    for file in set((ROOT / "tests").rglob("*.py")) - {MECHANISM}:
        text = file.read_text(encoding="utf-8")
        if any(name in text for name in forbidden):
            assert not forbidden & set(_names(ast.parse(text))), file
