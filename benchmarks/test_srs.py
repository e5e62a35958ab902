"""The promised speed of spectra, measured: `make bench-full`."""

from __future__ import annotations

import pytest

from benchmarks import srs

pytestmark = pytest.mark.bench


def test_spectra_beat_the_peers(capsys: pytest.CaptureFixture[str]) -> None:
    assert srs.main() == 0, capsys.readouterr().out
