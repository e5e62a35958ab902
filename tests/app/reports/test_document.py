"""A report is the same on screen and on paper, in the units of the bench: all its parts, nothing
taken for markup."""

from __future__ import annotations

import base64
import datetime as dt
import math
import re
import sys
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.common.number_format import (
    format_interval,
    join_words,
    measured_text,
    number,
    number_ranges,
    percent,
    percent_range,
    times,
)
from pyroshock.app.common.quantities import (
    in_shown_units,
    level_words,
    named_level,
    settings_words,
    shown_in,
    shown_unit,
)
from pyroshock.app.documents.document import (
    Bars,
    Bullets,
    Cell,
    ChartRow,
    Document,
    Paragraph,
    Section,
    ShareBar,
    Table,
    cell_text,
    mean_and_spread,
)
from pyroshock.app.documents.page import html_of
from pyroshock.app.documents.pdf import MissingPdfError, lay_out, pdf_of
from pyroshock.app.figures.figure import BandSeries, LineSeries, Plot, PlotAxis, category
from pyroshock.app.operations.diagnose.statements import own_error
from pyroshock.app.operations.diagnose.texts import shrinkage_line, where_lines
from support.checks.pdf_layout import (
    count_pages,
    lines_of,
    metadata_of,
    page_sizes,
    picture_of,
    words_of,
)
from support.checks.well_formed import Page, needs_nothing
from support.records import verdicts

HOSTILE = "<script>alert('x')</script>&\"quoted\" <b> \x00\x1b ]]>"


def chart(name: str = "steel") -> Plot:
    x = np.linspace(0, 1, 30)
    curve = np.sin(3 * x)
    series = (
        BandSeries(role=category(0), x=x, low=curve - 0.1, high=curve + 0.1),
        LineSeries(name=name, role=category(0), x=x, y=curve),
        LineSeries(name="brass", role=category(1), x=x, y=x),
    )
    axes = PlotAxis("time", "ms"), PlotAxis("force", "kN")
    return Plot(f"pulse of {name}", *axes, series, notes=(f"note on {name}",))


def document(word: str = "spring", rows: int = 3) -> Document:
    """Every kind of block, with `word` wherever a campaign's words can stand."""
    return Document(
        kind="Campaign",
        title=word,
        lead=f"lead of {word}",
        facts={"Operator": word},
        sections=(
            Section(word, (Paragraph(f"said of {word}"), Paragraph("remark", quiet=True))),
            Section(
                "Lines",
                (Bullets((f"first of {word}", "second"), "none"), Bullets((), "nothing here")),
            ),
            Section(
                "Table", (Table(word, ("name", word), [(word, float(i)) for i in range(rows)]),)
            ),
            Section("Empty", (Table("of nothing", ("a", "b"), (), "No rows."),)),
            Section(
                "Bars",
                (
                    Bars(
                        (
                            ShareBar(word, "93 %", 0.0, 0.93, "named", word),
                            ShareBar("x", "1", -1.0, 2.0, "floor"),
                        )
                    ),
                ),
            ),
            Section("One chart", (ChartRow((chart(word),)),)),
            Section("Charts", (ChartRow((chart(), chart(), chart())),)),
        ),
        date=dt.date(2026, 3, 2),
    )


def paper_text(content: Document) -> str:
    return " ".join(words_of(pdf_of(content)).split())


def test_page_and_paper_hold_every_part_and_words_are_never_markup() -> None:
    assert needs_nothing(Page(html_of(document()))) and html_of(document()) == html_of(document())
    assert pdf_of(document()) == pdf_of(document())
    page, paper = Page(html_of(document())).text, paper_text(document())
    for part in ("spring", "lead of spring", "Operator", "said of spring", "first of spring",
                 "nothing here", "No rows.", "93 %", "pulse of spring", "time (ms)", "brass",
                 "note on spring"):  # fmt: skip
        for text in (page, paper):
            assert part in text.replace("\xa0", " "), part
    page = html_of(document(HOSTILE))
    assert "<script" not in page and "<b>" not in page and "\x00" not in page and "\x1b" not in page
    assert "<script>alert('x')</script>&\"quoted\" <b>" in Page(page).text
    assert "<script>alert" in paper_text(document(HOSTILE)).replace(" ", "")


def test_a_pdf_reads_its_fonts_and_no_file_of_the_machine(tmp_path: Path) -> None:
    """Markup that got past every escape could still name a file."""
    picture = tmp_path / "secret.svg"
    picture.write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" width="200" height="200">'
        '<rect width="200" height="200"/></svg>'
    )

    def ink(address: str) -> float:
        into = BytesIO()
        lay_out(f'<img src="{address}" width="200" height="200">').write_to_pdf_stream(into)
        return float((picture_of(into.getvalue()) < 128).mean())

    inside = base64.b64encode(picture.read_bytes()).decode()
    assert ink(f"data:image/svg+xml;base64,{inside}") > 0.03, "the picture would be seen"
    assert ink(picture.as_uri()) == ink("http://192.0.2.1/x.svg") == 0.0


def test_pdf_has_its_date_its_letters_and_long_tables() -> None:
    facts = metadata_of(pdf_of(document()))
    assert facts["CreationDate"].removeprefix("D:").startswith("20260302000000")
    assert (facts["Title"], facts["Subject"]) == ("Campaign: spring", "lead of spring")
    letters = "Δv = 5.6 ± 0.1 m/s, ε ≤ 3 σ"
    pdf = pdf_of(document(letters))
    assert pdf.count(b"/Type /FontDescriptor") == pdf.count(b"/FontFile") >= 2, "all are inside"
    assert letters in words_of(pdf)
    pdf = pdf_of(document(rows=200))
    heads = sum(line.text.startswith("name") for line in lines_of(pdf)[1])
    assert count_pages(pdf) > 3 and heads >= count_pages(pdf) - 2


def table_of(*rows: Sequence[Cell], columns: Sequence[str]) -> Document:
    return Document("K", "t", "", {}, [Section("s", [Table("caption", columns, rows)])])


@pytest.mark.parametrize(("columns", "is_turned"), [(3, False), (12, True), (60, True)])
def test_wide_tables_turn_the_page_and_stay_on_it(columns: int, is_turned: bool) -> None:
    heads = [f"column-{i}" for i in range(columns)]
    pdf = pdf_of(table_of(["incompressible"] * columns, columns=heads))
    ((width, height),) = page_sizes(pdf)
    assert (width > height) is is_turned
    assert max(line.right_x for line in lines_of(pdf)[1]) <= width - 33.0
    text = re.sub(r"\s", "", words_of(pdf))
    assert text.count("incompressible") == columns


def test_columns_are_as_wide_as_their_words_and_numbers_are_not_broken() -> None:
    def right_end(word: str, content: Document) -> float:
        return max(line.right_x for line in lines_of(pdf_of(content))[1] if word in line.text)

    assert right_end("two", table_of(["one", "two"], columns=("a", "b"))) < 120
    content = table_of(["word " * 200, "5.62 ± 0.11"], columns=("a", "b"))
    assert any("5.62 ± 0.11" in line.text for line in lines_of(pdf_of(content))[1])
    assert right_end("5.62", content) > 500, "the words have what the number leaves"

    def of_numbers(*cells: float | str | None) -> bool:
        return Table("t", ("a",), [[cell] for cell in cells]).is_number(0)

    assert (
        of_numbers(1.0, None, 2)
        and of_numbers("5.62 ± 0.11", "7")
        and of_numbers("0.1 to 0.2", "-3")
    )
    assert not (of_numbers("steel", 3.0) or of_numbers("2026-11-22 08:09") or of_numbers(None))
    texts = {None: "–", 0.123456: "0.1235", 123456.0: "123500", 12: "12", 1.2e9: "1.2×10⁹"}
    assert {cell: cell_text(cell) for cell in texts} == texts and cell_text(float("nan")) == "–"


@pytest.mark.parametrize("length", [5, 60, 3000])
def test_words_that_do_not_end_stay_on_the_page(length: int) -> None:
    table = Table("t", ("a", "b"), [["x" * length, 1.0], ["y", 2.0]])
    pdf = pdf_of(Document("K", "t" * length, "", {}, [Section("s", [table])]))
    text = re.sub(r"\s", "", words_of(pdf))
    assert text.count("x") == length and text.count("t") >= length, "nothing is cut"


def test_missing_library_is_told_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "plutoprint", None)
    with pytest.raises(MissingPdfError, match=r"plutoprint is not installed.*pyroshock\[web\]"):
        pdf_of(document())


# --- settings and figures are told in the units of the bench ---
def test_factors_means_shares_and_ranges_are_told_in_the_units_of_the_bench() -> None:
    assert (
        level_words("tip_radius_m", 0.045) == "45 mm"
        and level_words("tank_pressure_pa", 38080.0) == "0.3808 bar"
    )
    assert (
        named_level("paint_job", "green") == "paint job green"
        and named_level("tip_radius_m", 0.03) == "tip radius 30 mm"
    )
    assert settings_words({"insulator": "none", "tip_material": "steel"}) == "no insulator, steel"
    assert named_level("insulator", "none") == "no insulator" and settings_words({}) == "all alike"
    texts = {
        (5.5, 5.6, 5.7): "5.60 ± 0.10",
        (5.6,): "5.6",
        (5.6, 5.6): "5.6",
        (1000.0, 1200.0): "1100 ± 140",
    }
    texts |= {(np.nan, 2.0): "2", (np.nan,): None, (): None}
    assert [mean_and_spread("mass_kg", np.array(v, dtype=np.float64)) for v in texts] == list(
        texts.values()
    )
    assert mean_and_spread("peak_force_n", np.array([5600.0, 5800.0])) == "5.70 ± 0.14"
    with shown_in("si"):
        assert mean_and_spread("peak_force_n", np.array([5600.0, 5800.0])) == "5700 ± 140"
        assert level_words("tip_radius_m", 0.045) == "0.045 m" and shown_unit("m/s2") == (
            "m/s²",
            1.0,
        )
    sentence = shrinkage_line(verdicts.gun().shrinkage[0], verdicts.gun())
    assert sentence.endswith(
        "97 % (95 to 98 %) of the error above the noise disappears. With a learned correction of "
        "the rest 0.0085 would be left; a correction is not a cause."
    )
    assert "correction" not in shrinkage_line(verdicts.verdict().shrinkage[0], verdicts.verdict())
    corner = shrinkage_line(verdicts.verdict().shrinkage[1], verdicts.verdict())
    assert corner.endswith("; there was no error to reduce.")
    lines = list(where_lines(verdicts.verdict().where))
    assert len(lines) == 6 and lines[-1].startswith("peak force of the contact falls")
    # Near certainty is not certainty, and what is no number is a dash.
    shares = {1.0: "100 %", 0.999: "> 99 %", 0.93: "93 %", 0.001: "< 1 %", 0.0: "0 %"}
    assert {share: percent(share) for share in shares} == shares
    numbers = {4000.0: "4000", 0.0123456: "0.0123", 2.9e7: "29000000", 3.4e-8: "3.4×10⁻⁸"}
    assert {value: number(value) for value in numbers} == numbers and percent_range(
        0.52, 0.68
    ) == "52 to 68 %"
    intervals = {
        (9.84, 7.841, 12.46): "9.8, 7.8, 12.5",
        (5351.2, 4098.0, 7559.0): "5400, 4100, 7600",
        (0.0997, 0.0911, 0.1202): "0.100, 0.091, 0.120",
        (-9.97e-05, -0.0415, 0.0413): "0.000, -0.042, 0.041",
        (31.0, 27.0, 36.0): "31, 27, 36",
        (5.0, 5.0, 5.0): "5, 5, 5",
        (9.1, 7.0, 12.0): "9.1, 7.0, 12.0",
        (2.143, 0.7, 3.4): "2.1, 0.7, 3.4",
        (1.0, math.nan, 2.0): "1, –, 2",
        (3e-8, 2e-8, 4e-8): "3×10⁻⁸, 2×10⁻⁸, 4×10⁻⁸",
    }
    assert {numbers: ", ".join(format_interval(*numbers)) for numbers in intervals} == intervals
    assert [times(ratio) for ratio in (42.3, 9.96, 0.891)] == ["42", "10", "0.89"]
    assert [join_words("abc"[:count]) for count in range(4)] == ["", "a", "a and b", "a, b and c"]
    assert join_words(["a", "b"], "or") == "a or b"
    assert (number(float("nan")), percent(float("nan")), percent(float("inf"))) == ("–", "–", "–")
    assert percent_range(float("nan"), 0.3) == "interval not known"


@given(
    value=st.floats(-1e6, 1e6),
    half_width=st.floats(1e-3, 1e5),
    place=st.floats(-1, 1),
)
def test_a_value_has_the_digits_that_its_interval_leaves(
    value: float, half_width: float, place: float
) -> None:
    """The second digit of the half-width is the last that is shown: no text is off by more than
    half of it, and none has digits beyond it."""
    middle = value - place * half_width
    numbers = (value, middle - half_width, middle + half_width)
    last = math.floor(math.log10((numbers[2] - numbers[1]) / 2)) - 1
    for number_shown, text in zip(numbers, format_interval(*numbers), strict=True):
        decimals = len(text.partition(".")[2])
        assert decimals <= max(0, -last)
        assert abs(float(text) - number_shown) <= 0.5 * 10.0**last * (1 + 1e-6)


@pytest.mark.parametrize(("own", "ci90", "words"), [
    (1.06695, (1.06616, 1.06774), "1.07"),
    (1.06695, (1.0212, 1.1104), "1.07 (1.02 to 1.11)"),
    (110.9, (103.4, 117.9), "111 (103 to 118)"),
    (34.1, (30.4, 37.3), "34.1 (30.4 to 37.3)"),
    (0.42, (0.06, 0.9), "0.42 (0.06 to 0.90)"),
    (4.2, None, "4.2"),
])  # fmt: skip
def test_an_error_in_tolerances_has_three_digits_at_most(
    own: float, ci90: tuple[float, float] | None, words: str
) -> None:
    assert own_error(own, ci90) == words


@pytest.mark.parametrize(("numbers", "words"), [
    ((), ""), ((7,), "7"), ((3, 1, 2, 5), "1–3, 5"), ((4, 5), "4, 5"), (range(1, 40), "1–39"),
    (range(1, 40, 2), "1, 3, 5, 7, 9, 11, 13, 15, and 12 more"),
])  # fmt: skip
def test_numbers_are_told_as_ranges(numbers: tuple[int, ...], words: str) -> None:
    assert number_ranges(numbers) == words


def test_a_value_has_the_digits_that_its_uncertainty_leaves() -> None:
    pairs = {
        (5.6234, 0.1123): "5.62 ± 0.11",
        (1234.5, 37.0): "1234 ± 37",
        (5.6, 0.0): "5.6",
        (2.0, float("nan")): "2",
    }
    assert {pair: measured_text(*pair) for pair in pairs} == pairs


@pytest.mark.parametrize(("stored", "shown"), [
    ("full scale (98066.5 m/s2) reached at -98066.5 m/s2 from 0.4145 s: only a bound",
     "full scale (10000 g) reached at -10000 g from 414.5 ms: only a bound"),
    ("noise of 4.95 N, peak 12500 N", "noise of 4.95 N, peak 12.5 kN"),
    ("integrates to 8.95e+03 mm in 12 s", "integrates to 8950 mm in 12 s"),
    ("an impulse of 12.5 N s after 3 samples of 2e3-01.npz",
     "an impulse of 12.5 N s after 3 samples of 2e3-01.npz"),
    ("38000 Pa and 8.07 m/s", "0.38 bar and 8.07 m/s"),
])  # fmt: skip
def test_stored_messages_are_shown_in_the_units_of_the_bench(stored: str, shown: str) -> None:
    assert in_shown_units(stored) == shown


@given(st.lists(st.floats(1e-6, 1e6), min_size=2, max_size=20))
def test_mean_is_told_to_a_tenth_of_the_spread(values: list[float]) -> None:
    array = np.array(values)
    text = mean_and_spread("mass_kg", array)
    assert text is not None
    mean, _, spread = text.partition(" ± ")
    if spread:
        assert abs(float(mean) - array.mean()) <= 0.06 * array.std(ddof=1)
