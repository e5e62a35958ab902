"""What benchmarks take from the tests, in an environment where another package is called
`tests`."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_another_package_called_tests_hides_nothing(tmp_path: Path) -> None:
    (tmp_path / "tests").mkdir()
    (tmp_path / "tests" / "__init__.py").touch()
    others = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join([str(tmp_path), *filter(None, others)]),
    }
    script = (
        "import tests, benchmarks.genetic, benchmarks.prediction, "
        "benchmarks.shared_records as shared\n"
    )
    script += "print(tests.__file__, shared.pulse_table.__code__.co_filename)"
    command = [sys.executable, "-W", "ignore", "-c", script]
    done = subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-2000:]
    other, ours = done.stdout.split()
    assert Path(other).parent == tmp_path / "tests"
    assert Path(ours).resolve() == (ROOT / "tests/support/records/pulse_tables.py").resolve()


def test_no_benchmark_imports_a_package_called_tests() -> None:
    sources = {path.name: path.read_text() for path in (ROOT / "benchmarks").glob("*.py")}
    assert not [
        name for name, text in sources.items() if "from tests." in text or "import tests" in text
    ]
