"""What a form holds is written as campaign.toml and runs.csv, and read back the same; and what the
files of a folder say is proposed with its source, and nothing else."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.app.operations.ingest.campaign_form import (
    FormChannel,
    FormTexts,
    description_of,
    texts_of,
)
from pyroshock.ingest.errors import IngestError
from pyroshock.ingest.folder.description import CampaignDescription, read_description
from pyroshock.ingest.folder.description_fields import BENCH, COLUMNS, FACTS, NOT_USED, ROLES
from pyroshock.ingest.folder.file_statements import read_statements
from pyroshock.ingest.folder.proposal import propose
from pyroshock.ingest.folder.typed_values import number_of, outline_of

#: Any text that a page sends on one line: no control characters, which the server refuses.
LINE = st.text(
    st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp", "Zs"), include_characters=" "),
    max_size=30,
).map(str.strip)
NAME = LINE.filter(bool)
NUMBER = st.floats(-1e9, 1e9, allow_nan=False).map(lambda number: f"{number:.12g}")
CELL = st.one_of(LINE, NUMBER)


@st.composite
def forms(draw: st.DrawFn) -> FormTexts:
    """Any content of the form."""
    kind = draw(st.sampled_from(["gun", "hammer", "plate"]))
    facts = {
        key.name: draw(NUMBER if key.is_number and draw(st.booleans()) else LINE)
        for key in (*FACTS, *BENCH)
        if draw(st.booleans())
    }
    roles = st.sampled_from([NOT_USED, "", *(role.value for role in ROLES)])
    names = draw(st.lists(NAME, max_size=4, unique=True))
    channels = [
        FormChannel(
            name,
            draw(roles),
            {key: draw(CELL) for key in ("unit", "sensitivity", "position", "axis", "range")},
        )
        for name in names
    ]
    own = draw(st.lists(st.from_regex(r"[a-z][a-z_]{2,12}", fullmatch=True), max_size=2))
    columns = ["run", "repetition", *COLUMNS[kind], *own]
    rows = [
        {
            column: str(draw(st.integers(0, 99))) if column == "run" else draw(LINE)
            for column in columns
        }
        | {"recording": f"recordings/{place}.npz"}
        for place in range(draw(st.integers(1, 3)))
    ]
    return FormTexts(kind, facts, channels, columns, {}, rows)


@settings(max_examples=60, deadline=None)
@given(forms())
def test_any_content_of_the_form_is_read_back_the_same(form: FormTexts) -> None:
    description = description_of(form)
    with tempfile.TemporaryDirectory() as folder:
        description.write(Path(folder))
        stated = read_description(Path(folder))
    assert stated == description
    shown = texts_of(form.kind, stated, [channel.name for channel in form.channels])
    assert description_of(shown) == description


def test_tables_of_any_names_are_written_and_read(tmp_path: Path) -> None:
    tables = {
        "campaign": {"name": 'a "quoted" name\\', "kind": "gun"},
        "bench": {"plate": {"outline_m": [[0.0, 0.0], [0.5, 0.0], [0.5, 0.25]]}},
        "channels": {"Force (Trigger)": {"quantity": "force", "unit": "N"}, "a.b": {"unit": "g"}},
    }
    written = CampaignDescription(tables, ("run", "repetition"), ({"run": "1", "repetition": "1"},))
    written.write(tmp_path)
    assert read_description(tmp_path) == written


@pytest.mark.parametrize(("text", "unit", "number"), [
    ("10 mm", "m", 0.01), ("10mm", "m", 0.01), ("0,01", "m", 0.01), ("320 g", "kg", 0.32),
    ("9.5 L", "m³", 0.0095), ("8 bar", "Pa", 8e5), ("1.4", "", 1.4), ("51.2 kHz", "Hz", 51200.0),
])  # fmt: skip
def test_a_number_is_taken_with_its_unit(text: str, unit: str, number: float) -> None:
    assert number_of(text, unit) == pytest.approx(number, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit"), [("10 kg", "m"), ("ten", "m"), ("1,250", "kg"), ("", "m")]
)
def test_what_is_no_number_stays_as_it_was_typed(text: str, unit: str) -> None:
    assert number_of(text, unit) == text  # and the ingest refuses it with its own words


def test_a_rectangle_is_an_outline() -> None:
    assert outline_of("600 mm x 0.4") == [[0.0, 0.0], [0.6, 0.0], [0.6, 0.4], [0.0, 0.4]]
    assert outline_of("0, 0; 0.3, 0; 0.3, 0.2") == [[0.0, 0.0], [0.3, 0.0], [0.3, 0.2]]
    assert outline_of("large") == "large"


def _recording(path: Path, **arrays: object) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez(path, fs=51_200.0, **arrays)


def test_what_files_do_not_say_is_not_filled_in(tmp_path: Path) -> None:
    folder = tmp_path / "spring"
    for name in ("0001-01", "0001-02", "0002-01"):
        _recording(folder / "recordings" / f"{name}.npz", force=np.zeros(64), ch7=np.zeros(64))
    proposal = propose(folder, read_statements(folder), "spring")
    description = proposal.description
    assert description.value("campaign") == {"name": "spring", "kind": "hammer"}
    assert description.value("bench") is None
    # the name tells what the first measures, and nothing tells a unit or what the second is
    assert description.value("channels") == {"force": {"quantity": "force"}, "ch7": {}}
    assert [(row["run"], row["repetition"]) for row in description.rows] == [
        ("1", "1"), ("1", "2"), ("2", "1"),
    ]  # fmt: skip
    filled = {*description.value("campaign"), "force.quantity", "run", "repetition", "recording"}
    assert {source.partition(".")[2] for source in proposal.sources} == filled
    text = proposal.campaign_text()
    assert "# date =" in text and "# mass_kg =" in text and "needed" in text


def test_volts_are_asked_for_and_never_taken_as_the_quantity(tmp_path: Path) -> None:
    text = "time [s],force [V],mystery [V]\n"
    text += "".join(f"{i / 1000:.3f},{i % 7 / 10},{i % 5 / 10}\n" for i in range(40))
    (tmp_path / "hit.csv").write_text(text, encoding="utf-8")
    channels = propose(tmp_path, read_statements(tmp_path)).description.value("channels")
    assert channels == {"force": {"quantity": "force"}, "mystery": {}}


def test_a_folder_without_recordings_says_what_was_expected(tmp_path: Path) -> None:
    (tmp_path / "notes.md").write_text("nothing", encoding="utf-8")
    with pytest.raises(IngestError, match="no recording; expected files with"):
        read_statements(tmp_path)
    with pytest.raises(IngestError, match="no such folder"):
        read_statements(tmp_path / "absent")


def test_a_file_that_cannot_be_read_is_named_with_its_reason(tmp_path: Path) -> None:
    _recording(tmp_path / "good.npz", force=np.zeros(64))
    (tmp_path / "bad.npz").write_bytes(b"no archive")
    statements = read_statements(tmp_path)
    assert [file.path for file in statements.readable] == ["good.npz"]
    (bad,) = [file for file in statements.files if file.fault]
    assert bad.path == "bad.npz" and "bad.npz" in str(bad.fault)
