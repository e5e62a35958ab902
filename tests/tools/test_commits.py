"""What the commit hooks refuse, and that they call what there is."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
import yaml

from tools import commits

ROOT = Path(__file__).resolve().parents[2]
HOOKS = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))


def test_large_file_is_refused_and_whole_ones_let_through(tmp_path: Path) -> None:
    (tmp_path / "series.npy").write_bytes(bytes(commits.LARGEST_BYTES + 1))
    (said,) = commits.objections(tmp_path / "series.npy")
    assert "1000001 bytes" in said
    shipped = ROOT / "examples" / "modal-hammer-hit" / "recordings" / "acceleration.lvm"
    assert list(commits.objections(shipped)) == []
    (tmp_path / "a.md").write_text("title\n========\n")
    assert commits.main([str(tmp_path / "a.md"), str(tmp_path / "gone.py")]) == 0


@pytest.mark.parametrize("mark", ["<" * 7 + " HEAD", "=" * 7, ">" * 7 + " theirs"])
def test_half_a_merge_is_refused_with_its_line(tmp_path: Path, mark: str, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "a.py").write_text(f"x = 1\n{mark}\n")
    assert commits.main([str(tmp_path / "a.py")]) == 1 and "line 2" in capsys.readouterr().err


def test_hooks_are_local_and_call_what_is_there() -> None:
    (repository,) = HOOKS["repos"]
    assert repository["repo"] == "local", "others are fetched from a network"
    targets = (ROOT / "Makefile").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    dev = project["optional-dependencies"]["dev"]
    for hook in repository["hooks"]:
        program, *words = hook["entry"].split()
        if program == "make":
            assert f"\n{words[-1]}:" in targets
        elif words[0] == "-m":
            assert (ROOT / f"{words[1].replace('.', '/')}.py").is_file()
        else:
            assert any(each.startswith(Path(program).name) for each in dev)
