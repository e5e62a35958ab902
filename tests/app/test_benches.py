"""A bench as a TOML file: what is no bench is refused by its key."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyroshock.app.twins.benches import PlateDrawing, bench_of_file, shipped_bench


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gun = 5", r"\[gun\] is 5; expected a table"),
        ("plate = []", r"\[plate\] is \[\]; expected a table"),
        ("[plate]\nsensors = [1, 2]", r"points are \[1, 2\]; expected a table of names and places"),
        ("[plate]\noutline_m = []", "expected three corners or more"),
        ("[plate]\noutline_m = [[0, 0], [1, 0]]", "expected three corners or more"),
        ("[plate]\noutline_m = [[0, 0], [1, 0], [2, 0]]", "around an area"),
        ("[plate]\noutline_m = [[0, 0], [1e308, 0], [1e308, 1e308]]", "within 1000 m"),
        ("[plate]\noutline_m = [[0, 0], [nan, 0], [1, 1]]", "within 1000 m"),
        ("a = " + "[" * 5000, "hundreds deep; expected at most 16"),
    ],
)
def test_what_is_no_bench_is_refused(tmp_path: Path, text: str, said: str) -> None:
    """Each ended in a traceback, or in a plate of NaN."""
    path = tmp_path / "bench.toml"
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"(?s)bench\.toml: .*{said}"):
        bench_of_file(path, shipped_bench())


def test_outline_in_either_direction_is_a_plate() -> None:
    outline = [(0.0, 0.0), (1.0, 0.0), (1.0, 0.6), (0.0, 0.6)]
    for corners in (outline, outline[::-1]):
        assert PlateDrawing.of(corners, "test").area_m2 == pytest.approx(0.6)
