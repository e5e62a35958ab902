"""Tables of runs from spreadsheets give what the same table gives as CSV, and what would be lost is
refused."""

from __future__ import annotations

import datetime as dt
import io
import zipfile

import openpyxl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.ingest.errors import IngestError
from pyroshock.ingest.folder.runs_table import read_runs
from pyroshock.ingest.folder.tables import cell_text, read_table
from support.records.campaigns import gun_campaign, gun_rows, write_runs
from support.stores.stores import content, ingested


def write_xlsx(path, rows, sheet="Sheet1", first_row=1):
    book = openpyxl.Workbook()
    page = book.active
    page.title = sheet
    for i, cells in enumerate([list(rows[0]), *(list(row.values()) for row in rows)]):
        for j, value in enumerate(cells):
            page.cell(first_row + i, 1 + j, None if value == "" else value)
    book.save(path)
    return book


def write_xls(path, rows, sheet="Sheet1"):
    import xlwt

    book = xlwt.Workbook()
    page = book.add_sheet(sheet)
    date = xlwt.easyxf(num_format_str="YYYY-MM-DD")
    for i, cells in enumerate([list(rows[0]), *(list(row.values()) for row in rows)]):
        for j, value in enumerate(cells):
            if value != "":
                page.write(i, j, value, *([date] if isinstance(value, dt.date) else []))
    book.save(str(path))


WRITERS = {".xlsx": write_xlsx, ".xls": write_xls}
ROWS = [
    {
        **row,
        "humidity": 0.1 + 0.2 * i,
        "day": dt.date(2026, 3, 2 + i),
        "checked": True,
        "serial": "007",
        "note": "",
    }
    for i, row in enumerate(gun_rows())
]


def material(name):
    return name


@pytest.mark.parametrize("suffix", WRITERS)
def test_sheet_gives_the_rows_of_the_csv(tmp_path, suffix):
    plain = gun_campaign(tmp_path / "csv")
    write_runs(plain, [{**row, "checked": "TRUE"} for row in ROWS])
    other = gun_campaign(tmp_path / "sheet")
    (other / "runs.csv").unlink()
    WRITERS[suffix](other / f"runs{suffix}", ROWS)
    expected, rows = read_runs(plain, "gun", material), read_runs(other, "gun", material)
    assert [(row.line, row.run, row.repetition) for row in rows] == [
        (2, 1, 1),
        (3, 2, 1),
        (4, 3, 1),
    ]
    assert [row.levels for row in rows] == [row.levels for row in expected]
    assert [row.measured_velocity_m_s for row in rows] == [11.0, 12.0, 13.0]
    assert rows[0].levels_by_factor["day"].label == "2026-03-02"
    assert rows[0].levels_by_factor["humidity"].number == 0.1


@pytest.mark.parametrize("suffix", WRITERS)
def test_folder_with_a_sheet_is_the_same_campaign(sqlite_url, tmp_path, suffix):
    folder = gun_campaign(tmp_path / "gun")
    ingested(sqlite_url, folder)
    before = content(sqlite_url)
    (folder / "runs.csv").unlink()
    WRITERS[suffix](folder / f"runs{suffix}", gun_rows())
    assert "nothing new" in ingested(sqlite_url, folder).stderr
    assert content(sqlite_url) == before


@pytest.mark.parametrize("suffix", WRITERS)
def test_fault_is_told_with_row_and_column_of_the_sheet(refused, gun_folder, suffix):
    (gun_folder / "runs.csv").unlink()
    rows = [
        {**row, "tip_material": "cheese" if i == 1 else "steel"} for i, row in enumerate(gun_rows())
    ]
    WRITERS[suffix](gun_folder / f"runs{suffix}", rows)
    refused(
        gun_folder, f"runs{suffix}: row 3, column 'tip_material': 'cheese'; expected a material"
    )


def test_folder_of_two_tables_or_none_is_refused(refused, gun_folder):
    write_xlsx(gun_folder / "runs.xlsx", gun_rows())
    refused(gun_folder, "runs.csv: runs.xlsx beside it", "expected one table")
    (gun_folder / "runs.xlsx").unlink()
    (gun_folder / "runs.csv").unlink()
    refused(gun_folder, "no runs.csv")


def told(path):
    with pytest.raises(IngestError) as error:
        read_table(path, path.name)
    return str(error.value)


def test_sheet_called_runs_is_read_among_several_with_its_row_numbers(tmp_path):
    book = write_xlsx(tmp_path / "runs.xlsx", gun_rows(), sheet="Runs of May")
    book.create_sheet("notes")["B2"] = "tip changed"
    book.create_sheet("empty")
    book.save(tmp_path / "runs.xlsx")
    assert "2 sheets hold something: 'Runs of May', 'notes'" in told(tmp_path / "runs.xlsx")
    book["Runs of May"].title = "runs"
    book.save(tmp_path / "runs.xlsx")
    assert len(read_table(tmp_path / "runs.xlsx", "runs.xlsx")[1]) == 3
    book = write_xlsx(tmp_path / "runs.xlsx", gun_rows(), first_row=3)
    book.active.insert_rows(5)
    book.save(tmp_path / "runs.xlsx")
    assert [line for line, _ in read_table(tmp_path / "runs.xlsx", "runs.xlsx")[1]] == [4, 6, 7]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (lambda page: page.__setitem__("C3", "=1/0"), "row 3, column C: '=1/0'; expected a value"),
        (lambda page: page.merge_cells("E2:E4"), "merged cells E2:E4"),
        (
            lambda page: page.__setitem__("J3", "late"),
            "row 3, column J: 'late'; the header has no name",
        ),
        (
            lambda page: page.__setitem__("XFD1048576", 1),
            "row 1,048,576, column XFD; expected a table of at most",
        ),
    ],
)
def test_what_would_be_lost_is_refused(tmp_path, spoil, words):
    book = write_xlsx(tmp_path / "runs.xlsx", gun_rows())
    spoil(book.active)
    book.save(tmp_path / "runs.xlsx")
    assert words in told(tmp_path / "runs.xlsx")


def test_file_that_unpacks_to_more_than_it_should_or_says_is_refused(tmp_path):
    write_xlsx(tmp_path / "good.xlsx", gun_rows())
    with (
        zipfile.ZipFile(tmp_path / "good.xlsx") as good,
        zipfile.ZipFile(tmp_path / "runs.xlsx", "w", 8) as bomb,
    ):
        for member in good.infolist():
            bomb.writestr(member.filename, good.read(member))
        bomb.writestr("xl/media/image1.png", b"\0" * 60_000_000)
    assert (tmp_path / "runs.xlsx").stat().st_size < 100_000
    assert "unpacks to 60,0" in told(tmp_path / "runs.xlsx")
    write_xlsx(tmp_path / "good.xlsx", gun_rows())
    stream = io.BytesIO((tmp_path / "good.xlsx").read_bytes())
    with zipfile.ZipFile(stream) as archive:
        member = next(each for each in archive.infolist() if each.filename.endswith("sheet1.xml"))
    raw = stream.getvalue()
    size = member.file_size.to_bytes(4, "little")
    (tmp_path / "runs.xlsx").write_bytes(raw.replace(size, (40).to_bytes(4, "little")))
    assert raw.count(size) >= 1
    assert "damaged" in told(tmp_path / "runs.xlsx")


@pytest.mark.parametrize("name", ["runs.xlsx", "runs.xls"])
@pytest.mark.parametrize(
    "data", [b"", b"run,repetition\n1,1\n", b"PK\x03\x04" + b"\0" * 40, b"\xd0\xcf\x11\xe0" * 200]
)
def test_file_that_is_no_spreadsheet(tmp_path, name, data):
    (tmp_path / name).write_bytes(data)
    assert told(tmp_path / name).startswith(f"{name}: damaged, or not what its suffix says")


@given(st.floats(allow_nan=False, allow_infinity=False), st.integers(-(10**14), 10**14))
def test_number_reads_back_exactly_and_a_whole_one_has_no_point(value, whole):
    assert float(cell_text(value)) == value
    assert cell_text(float(whole)) == str(whole)
