"""Modal tables: what is read and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.plate.table import modal_plate_from_table, read_modal_table

HEADER = "mode,frequency_hz,damping_ratio,shape_impact,shape_a,shape_impact_2,shape_b"


def written(folder, text):
    path = folder / "plate_modes.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_table_is_read_in_rising_order(tmp_path):
    plate = read_modal_table(written(tmp_path, f"{HEADER}\n2,300,0.02,1,2,3,4\n1,0,0.01,5,6,7,8\n"))
    np.testing.assert_array_equal(plate.frequency_hz, [0, 300])
    np.testing.assert_array_equal(plate.damping_ratio, [0.01, 0.02])
    np.testing.assert_array_equal(plate.shape_impact, [[5, 1], [7, 3]])
    np.testing.assert_array_equal(plate.shapes, [[6, 2], [8, 4]])
    assert plate.impact_points == ("#1", "#2")
    assert plate.sensors == ("a", "b")


def test_a_german_table_is_the_same(tmp_path):
    english = read_modal_table(
        written(tmp_path, "frequency_hz,damping_ratio,shape_impact,shape_a\n1.5,0.01,0.5,-2.25\n")
    )
    german = read_modal_table(
        written(tmp_path, "frequency_hz;damping_ratio;shape_impact;shape_a\n1,5;0,01;0,5;-2,25\n")
    )
    np.testing.assert_array_equal(english.shapes, german.shapes)
    np.testing.assert_array_equal(english.frequency_hz, german.frequency_hz)


def test_an_example_is_read(examples):
    path = examples / "plate-damping" / "plate_modes.csv"
    rows = np.genfromtxt(path, delimiter=",", names=True)
    plate = read_modal_table(path)
    assert plate.frequency_hz.tolist() == rows["frequency_hz"].tolist()
    assert plate.sensors == ("acceleration_1", "acceleration_2")
    assert plate.shape_impact[0].tolist() == rows["shape_impact"].tolist()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("frequency_hz,damping_ratio,shape_impact,shape_a\n5,0.1,x,1\n", r"csv: row 2, column 'shape_impact': 'x'"),
        (
            "frequency_hz,damping_ratio,shape_impact,shape_a\n5,1.1,1,1\n",
            r"row 2, column 'damping_ratio': '1.1'",
        ),
        ("frequency_hz,damping_ratio,shape_impact,shape_a\n-5,0,1,1\n", r"row 2, column 'frequency_hz': '-5'"),
        ("frequency_hz,damping_ratio,shape_impact,shape_a\n5,0,inf,1\n", r"row 2, column 'shape_impact': 'inf'"),
        ("frequency_hz,damping_ratio,shape_impact,shape_a\n5,0,1\n", r"row 2: 3 cells; expected 4"),
        ("frequency_hz,damping_ratio,shape_impact\n5,0,1\n", r"csv: no column 'shape_CHANNEL'"),
        ("frequency_hz,shape_impact,shape_a\n5,0,1\n", r"csv: no column 'damping_ratio'"),
        ("damping_ratio,shape_impact,shape_a\n0,1,1\n", r"csv: no column 'frequency_hz'; there are: damping_ratio, "),
        ("frequency_hz,damping_ratio,shape_a\n5,0,1\n", r"csv: no column 'shape_impact'"),
        ("frequency_hz,damping_ratio,shape_impact,shape_a,shape_a\n", r"expected a header and at least one mode"),
        ("frequency_hz,damping_ratio,shape_impact,shape_a,shape_a\n5,0,1,1,1\n", r"column 'shape_a' in the header"),
        (f"{HEADER}\n1,5,0,1,1,1,1\n1,6,0,1,1,1,1\n", r"mode 1 stands twice"),
    ],
)
def test_a_refusal_names_the_place(tmp_path, text, message):
    with pytest.raises(ValueError, match=message):
        read_modal_table(written(tmp_path, text))


def test_a_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / "plate_modes.csv"
    path.write_bytes(b"\xff\xfe\x00mode")
    with pytest.raises(ValueError, match=r"plate_modes\.csv: byte 0 is not UTF-8"):
        read_modal_table(path)
    with pytest.raises(FileNotFoundError):
        read_modal_table(tmp_path / "none.csv")


def test_columns_of_unequal_length_are_refused():
    columns = {"frequency_hz": [1.0, 2.0], "damping_ratio": [0.1, 0.1], "shape_impact": [1.0], "shape_a": [1.0, 1.0]}
    with pytest.raises(ValueError, match="shape_impact"):
        modal_plate_from_table(columns)
