"""In a browser: the record of an impact with one cursor, one view and its findings, and spectra
with their differences on linked axes."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pyroshock.app.operations.impacts.signals import channel_window
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact, Pulse
from pyroshock.schema.recordings import QualityFinding, RecordedChannel
from sqlalchemy import select
from support.processes.browsers import SLOW, at, page_of, screenshot, until

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

#: Of one sample of the virtual bench's records, in ms.
SAMPLE_MS = 0.01
#: Scales of what a page shows, by the unit of its axis.
SCALES = {"kN": 1e-3, "g": 1 / 9.80665, "mm": 1e3, "bar": 1e-5, "V": 1.0}
MESSAGE = "3 samples are missing"

STRIPS = "document.querySelector('#channels .plot').chart"
RANGES = f"{STRIPS}.charts.map((chart) => chart.range.x)"
#: Of every strip: its channel, unit, the pixel of the cursor's line, and the words beside it.
CURSORS = f"""{STRIPS}.charts.map((chart) => {{
  const box = chart.canvas.getBoundingClientRect(),
    line = chart.canvas.querySelector(".cursor-line"),
    words = chart.canvas.querySelector(".cursor-value");
  return {{
    channel: Number(chart.element.dataset.channel),
    unit: chart.figure.y.unit,
    line: line && box.left + parseFloat(line.getAttribute("d").slice(1)),
    words: words && words.textContent,
    exact: chart.element.dataset.exact,
  }};
}})"""


def a_shot(lab: Any) -> int:
    """An impact of the gun, with every channel and a pulse."""
    with lab.reading() as session:
        query = (
            select(Impact.id)
            .join(Campaign, Impact.campaign_id == Campaign.id)
            .join(Pulse, Pulse.impact_id == Impact.id)
            .where(Campaign.name == "rehearsal", Pulse.current)
            .order_by(Impact.id)
        )
        return session.scalars(query).first()


def contact_ms(lab: Any, impact: int) -> tuple[float, float]:
    with lab.reading() as session:
        pulse = session.scalars(select(Pulse).where(Pulse.impact_id == impact, Pulse.current)).one()
        return 1e3 * pulse.start_s, 1e3 * (pulse.start_s + pulse.contact_time_s)


def stored(lab: Any, channel: int) -> tuple[np.ndarray, np.ndarray]:
    """Times in ms and values in SI of a channel, as the store has them."""
    with lab.reading() as session:
        window = channel_window(session, channel, points=200_000)
        return 1e3 * window.time_s, window.values


_EXPONENTS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


def numbers_of(words: str) -> list[float]:
    return [
        float(text.replace("−", "-").replace("×10", "e").translate(_EXPONENTS))
        for text in re.findall(r"−?[\d.]+(?:×10[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)?", words)
    ]


def opened(page: Any, impact: int, rest: str = "") -> None:
    at(page, f"/impacts/{impact}{rest}")
    page.wait_for_selector("#channels[data-zoomable=yes]")


def loaded(page: Any) -> None:
    page.wait_for_selector("#channels[data-loaded=yes]")


def point_in(page: Any, strip: int, share: float) -> float:
    """The mouse in a strip, at this share of its frame; gives the pixel."""
    place = page.locator("#channels .row-plot").nth(strip)
    place.scroll_into_view_if_needed()
    box = place.bounding_box()
    frame = page.evaluate(f"{STRIPS}.charts[{strip}].frame")
    x = box["x"] + frame["left"] + share * (frame["right"] - frame["left"])
    page.mouse.move(x, box["y"] + frame["bottom"] - 6)
    return x


def test_one_cursor_goes_through_all_channels_and_says_the_stored_values(browser, lab):
    impact = a_shot(lab)
    begin, end = contact_ms(lab, impact)
    low, high = begin - (end - begin), begin + 3 * (end - begin)
    with page_of(browser, lab, width=1400) as page:
        opened(page, impact)
        screenshot(page, "record", 900)
        for strip, share in ((0, 0.3), (2, 0.55), (5, 0.9)):
            x = point_in(page, strip, share)
            time_ms = low + share * (high - low)
            cursors = page.evaluate(CURSORS)
            assert len(cursors) == 8
            for cursor in cursors:
                assert cursor["line"] == pytest.approx(x, abs=2.5)
                assert cursor["line"] == pytest.approx(cursors[0]["line"], abs=0.2)
                times, values = stored(lab, cursor["channel"])
                near = values[np.abs(times - time_ms) <= 1.5 * SAMPLE_MS] * SCALES[cursor["unit"]]
                (shown,) = numbers_of(cursor["words"])
                assert np.abs(near - shown).min() <= 1e-3 * abs(shown) + 1e-9, cursor
            readout = page.inner_text("#channels .time")
            assert numbers_of(readout)[0] == pytest.approx(time_ms, abs=2 * SAMPLE_MS)
            assert "contact begins" in readout


def test_keys_alone_move_the_cursor_through_all_channels(browser, lab):
    with page_of(browser, lab, width=1400) as page:
        opened(page, a_shot(lab))
        page.locator("#channels .canvas").first.focus()
        page.keyboard.press("ArrowRight")
        first_cursors = page.evaluate(CURSORS)
        page.keyboard.press("ArrowRight")
        moved_cursors = page.evaluate(CURSORS)
        assert all(b["line"] < a["line"] for b, a in zip(first_cursors, moved_cursors, strict=True))
        spoken = page.locator("#channels .unseen[role=status]").inner_text()
        assert spoken.count(";") == 7 and "force_1" in spoken


def test_zoom_and_pan_move_all_channels_and_fetch_every_sample(browser, lab):
    impact = a_shot(lab)
    with page_of(browser, lab, width=1400) as page:
        opened(page, impact)
        page.keyboard.press("w")
        loaded(page)
        point_in(page, 1, 0.30)
        page.mouse.down()
        point_in(page, 1, 0.31)
        point_in(page, 1, 0.33)
        page.mouse.up()
        loaded(page)
        page.wait_for_selector("#channels [data-exact=true]")
        ranges = page.evaluate(RANGES)
        assert all(ends == pytest.approx(ranges[0]) for ends in ranges)
        low, high = ranges[0]
        assert "Every sample is shown" in page.inner_text("#channels .shown")
        for strip in range(8):
            x, y, channel, unit = page.evaluate(
                f"""(({{figure: {{series: [own], y}}, element}}) =>
                  [own.x, own.y, Number(element.dataset.channel), y.unit])
                  ({STRIPS}.charts[{strip}])"""
            )
            times, values = stored(lab, channel)
            inside = (times >= low - 1e-6) & (times <= high + 1e-6)
            shown = np.array(
                [(a, b) for a, b in zip(x, y, strict=True) if low - 1e-6 <= a <= high + 1e-6]
            )
            assert 100 < inside.sum() < 2001
            np.testing.assert_allclose(shown[:, 0], times[inside], rtol=0, atol=1e-6)
            np.testing.assert_allclose(shown[:, 1], values[inside] * SCALES[unit], rtol=1e-9)
        page.locator("#channels .canvas").first.focus()
        page.keyboard.press("Shift+ArrowRight")
        moved = page.evaluate(RANGES)
        step = 0.1 * (high - low)
        assert all(ends == pytest.approx([low + step, high + step], rel=1e-9) for ends in moved)


def test_the_whole_record_and_the_contact_are_a_key_away(browser, lab):
    impact = a_shot(lab)
    begin, end = contact_ms(lab, impact)
    with page_of(browser, lab, width=1400) as page:
        opened(page, impact)
        contact = [begin - (end - begin), begin + 3 * (end - begin)]
        assert page.evaluate(RANGES)[0] == pytest.approx(contact)
        page.keyboard.press("w")
        loaded(page)
        channels = {cursor["channel"] for cursor in page.evaluate(CURSORS)}
        records = [stored(lab, channel)[0] for channel in channels]
        whole = [min(times[0] for times in records), max(times[-1] for times in records)]
        assert all(ends == pytest.approx(whole) for ends in page.evaluate(RANGES))
        point_in(page, 0, 0.4)
        for cursor in page.evaluate(CURSORS):
            # of a bucket the least and the largest value, between which the sample is
            assert cursor["exact"] == "false"
            times, values = stored(lab, cursor["channel"])
            time_ms = whole[0] + 0.4 * (whole[1] - whole[0])
            here = float(np.interp(time_ms, times, values)) * SCALES[cursor["unit"]]
            shown = numbers_of(cursor["words"])
            room = 2e-3 * max(map(abs, shown))
            assert min(shown) - room <= here <= max(shown) + room, cursor
        page.keyboard.press("c")
        loaded(page)
        assert page.evaluate(RANGES)[0] == pytest.approx(contact)
        assert "#" not in page.url
        words = page.inner_text("#neighbours")
        assert all(text in words for text in ("previous impact", "next impact", "whole record"))


@pytest.fixture(scope="module")
def found(lab):
    """A shot in whose force a check found three samples; gives impact, begin and end in ms."""
    impact = a_shot(lab)
    begin, end = contact_ms(lab, impact)
    start_s, length_s = 1e-3 * (begin + 0.25 * (end - begin)), 1e-4
    with lab.store.writing() as session:
        recording = session.get_one(Impact, impact).recording_id
        force = session.scalars(
            select(RecordedChannel)
            .where(RecordedChannel.recording_id == recording, RecordedChannel.quantity == "force")
            .order_by(RecordedChannel.name)
        ).first()
        session.add(
            QualityFinding(
                recording_id=recording,
                channel_id=force.id,
                impact_id=impact,
                check="dropouts",
                severity="reject",
                message=MESSAGE,
                evidence={"first_time_s": start_s, "longest_s": length_s, "runs": 1},
            )
        )
    return impact, 1e3 * start_s, 1e3 * (start_s + length_s)


def test_findings_are_drawn_at_their_time_with_their_sentence(browser, lab, found):
    impact, begin, end = found
    with page_of(browser, lab, width=1400) as page:
        opened(page, impact)
        place = page.evaluate(
            f"""(({{frame, range, canvas}}) => {{
              const path = canvas.querySelector("path[fill='var(--bad)']"),
                numbers = path.getAttribute("d").match(/[\\d.]+/g).map(Number),
                time = (x) => range.x[0] + (x - frame.left) / (frame.right - frame.left)
                  * (range.x[1] - range.x[0]);
              return {{ start: time(numbers[0]), stop: time(numbers[2]),
                        share: (numbers[0] + 1 - frame.left) / (frame.right - frame.left) }};
            }})({STRIPS}.charts[0])"""
        )
        low, high = page.evaluate(RANGES)[0]
        pixel = (high - low) / 700
        assert place["start"] == pytest.approx(begin, abs=pixel)
        assert place["stop"] == pytest.approx(end, abs=pixel)
        point_in(page, 0, place["share"])
        assert MESSAGE in page.locator("#channels .chart-tip").first.inner_text()
        item = page.locator("#findings li", has_text=MESSAGE)
        item.get_by_role("button").click()
        loaded(page)
        low, high = page.evaluate(RANGES)[0]
        assert low < begin and end < high and high - low < 3.0


def _shows(page: Any, ranges: list[list[float]]) -> Callable[[], bool]:
    return lambda: page.evaluate(RANGES)[0] == pytest.approx(ranges[0], rel=1e-5)


def test_the_address_restores_what_is_shown_of_a_record(browser, lab):
    with page_of(browser, lab, width=1400) as page:
        opened(page, a_shot(lab))
        assert "#" not in page.url
        for keys in (["w"], ["c", "+"], ["Shift+ArrowLeft"]):
            page.locator("#channels .canvas").first.focus()
            for key in keys:
                page.keyboard.press(key)
            loaded(page)
            ranges, address = page.evaluate(RANGES), page.url
            assert "channels.x=" in address
            page.goto("about:blank")
            page.goto(address)
            page.wait_for_selector("#channels[data-zoomable=yes]")
            until(_shows(page, ranges), 5 * SLOW)
            for restored, ends in zip(page.evaluate(RANGES), ranges, strict=True):
                assert restored == pytest.approx(ends, rel=1e-5)


def test_the_page_of_an_impact_is_three_screens_high_at_most(browser, lab, found):
    with page_of(browser, lab, width=1400) as page:
        opened(page, found[0])
        assert page.evaluate("document.documentElement.scrollHeight") <= 3 * 900
        strips = page.locator("#channels").bounding_box()
        spectrum = page.locator("#spectrum").bounding_box()
        assert spectrum["x"] >= strips["x"] + strips["width"]
        assert abs(spectrum["y"] - strips["y"]) < 20
        page.set_viewport_size({"width": 390, "height": 844})
        until(lambda: page.locator("#channels").bounding_box()["width"] < 390, 5 * SLOW)
        strips = page.locator("#channels").bounding_box()
        spectrum = page.locator("#spectrum").bounding_box()
        assert spectrum["y"] >= strips["y"] + strips["height"]


def test_the_record_is_usable_in_seconds_on_a_slow_line(browser, lab):
    """1.6 Mbit/s and 150 ms: until all channels are drawn and take zooms and keys."""
    line = {
        "offline": False,
        "latency": 150,
        "downloadThroughput": 1.6e6 / 8,
        "uploadThroughput": 0.75e6 / 8,
    }
    impact = a_shot(lab)
    with page_of(browser, lab, width=1400) as page:
        opened(page, impact)  # the server has read the store once
    with page_of(browser, lab, width=1400) as page:
        session = page.context.new_cdp_session(page)
        session.send("Network.enable")
        session.send("Network.emulateNetworkConditions", line)
        begun = time.monotonic()
        page.goto(f"/impacts/{impact}", wait_until="commit")
        page.wait_for_selector("#channels[data-zoomable=yes]")
        assert time.monotonic() - begun < 4.0 * SLOW


# --- spectra: levels and differences on one axis, four-coordinate paper ---


def spectra_address(lab: Any, count: int = 6) -> str:
    with lab.reading() as session:
        query = (
            select(Impact.id)
            .join(Campaign, Impact.campaign_id == Campaign.id)
            .where(Campaign.name == "rehearsal")
            .order_by(Impact.id)
        )
        keys = session.scalars(query.limit(count)).all()
    return "/compare/spectra?impacts=" + ",".join(map(str, keys))


LEVELS = "document.querySelector('#spectra .plot').chart"
PAPER = "document.querySelector('#paper .plot').chart"


@pytest.mark.parametrize("width", [1400, 390])
def test_lines_of_four_coordinate_paper_run_at_45_degrees(browser, lab, width):
    angles = f"""[...{PAPER}.drawing.querySelectorAll("path[stroke='var(--rule)']")]
      .map((path) => path.getAttribute("d").match(/^M([-\\d.]+) ([-\\d.]+)L([-\\d.]+) ([-\\d.]+)$/))
      .filter(Boolean).map((ends) => ends.slice(1).map(Number))"""
    with page_of(browser, lab, width=width) as page:
        at(page, spectra_address(lab))
        for zoomed in (False, True):
            if zoomed:
                page.evaluate(f"{PAPER}.zoom({{ x: [300, 2000], y: [1, 3] }})")
            lines = page.evaluate(angles)
            assert len(lines) >= 4
            slopes = [math.degrees(math.atan2(y1 - y2, x2 - x1)) for x1, y1, x2, y2 in lines]
            assert all(abs(abs(slope) - 45) < 0.2 for slope in slopes), slopes
            assert min(slopes) < 0 < max(slopes)


def test_spectra_differences_and_paper_have_one_view_and_one_cursor(browser, lab):
    with page_of(browser, lab, width=1400) as page:
        at(page, spectra_address(lab))
        screenshot(page, "spectra", 1000)
        page.evaluate(f"{LEVELS}.charts[0].zoom({{ x: [300, 900] }})")
        assert page.evaluate(f"{LEVELS}.charts[1].range.x") == pytest.approx([300, 900])
        assert page.evaluate(f"{PAPER}.range.x") == pytest.approx([300, 900])
        page.evaluate(f"{PAPER}.zoom({{ x: [500, 2000] }})")
        assert (
            page.evaluate(f"{LEVELS}.charts.map((chart) => chart.range.x)")
            == [pytest.approx([500, 2000])] * 2
        )
        box = page.locator("#spectra .row-plot").first.bounding_box()
        page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.5 * box["height"])
        frequencies = page.evaluate(
            f"""[...{LEVELS}.charts, {PAPER}].map((chart) => {{
              const line = chart.canvas.querySelector(".cursor-line");
              return line && chart.sx.back(parseFloat(line.getAttribute("d").slice(1)));
            }})"""
        )
        assert frequencies == [pytest.approx(frequencies[0], rel=5e-3)] * 3
        assert "dB" in page.locator("#spectra .chart-tip").first.inner_text()


def test_zoomed_spectra_keep_three_numbers_on_both_axes(browser, lab):
    counts = f"""(({{drawing, frame}}) => [...drawing.querySelectorAll("text")]
      .map((text) => [text.getAttribute("text-anchor"), Number(text.getAttribute("y")),
                      text.textContent])
      .filter(([, , words]) => /^[−\\d.]+$/.test(words))
      .reduce((sum, [anchor]) => ({{ ...sum, [anchor]: (sum[anchor] || 0) + 1 }}), {{}}))
      ({LEVELS}.charts[%d])"""
    with page_of(browser, lab, width=1400) as page:
        at(page, spectra_address(lab))
        for x, y in (([300, 900], [800, 3000]), ([110, 190], [210, 480]), ([1010, 1100], [10, 99])):
            page.evaluate(f"{LEVELS}.charts[0].zoom({{ x: {x}, y: {y} }})")
            upper, lower = (page.evaluate(counts % i) for i in range(2))
            assert upper["end"] >= 3 and lower["middle"] >= 3, (x, y, upper, lower)


def test_an_axis_names_three_numbers_at_least_however_far_one_zooms(browser, lab):
    """2,000 random spans, of a thousandth of a decade to eight decades, on narrow and wide axes."""
    ticks_of = """axes => axes.map(([scale, low, high, most]) =>
        pyroshockAxes.ticksOf({categories: [], scale}, low, high, most))"""
    rng = np.random.default_rng(5)
    low = 10 ** rng.uniform(-3, 4, 2000)
    high = low * 10 ** (10 ** rng.uniform(-3, 0.9, 2000))
    axes = [
        (("log", "linear")[i % 2], float(low[i]), float(high[i]), float(rng.uniform(2, 10)))
        for i in range(2000)
    ]
    with page_of(browser, lab) as page:
        at(page, "/compare?campaign=rehearsal")
        shown = page.evaluate(ticks_of, axes)
        for (scale, begin, end, most), ticks in zip(axes, shown, strict=True):
            values, names = zip(*ticks, strict=True)
            assert len(ticks) >= min(3, max(2, int(most))), (scale, begin, end, most)
            assert len(ticks) <= max(2 * most, 6), (scale, begin, end, most)
            assert begin * (1 - 1e-9) <= min(values) and max(values) <= end * (1 + 1e-9)
            assert len(set(names)) == len(names)
        within = page.evaluate(ticks_of, [["log", 100.0, 1000.0, 6.0]])
        assert [value for value, _ in within[0]] == [100, 200, 500, 1000]


def test_the_two_bands_have_two_shades_on_the_page(browser, lab):
    """Of the legend and of the picture, on white: their luminance differs by more than a tenth."""
    with page_of(browser, lab, width=1400, color_scheme="light") as page:
        at(page, spectra_address(lab, 2))
        shades = page.evaluate(
            f"""["±3 dB", "±6 dB"].map((name) => {LEVELS}.charts[1].figure.series
              .find((own) => own.name === name).opacity)"""
        )
        swatches = page.evaluate(
            """[...document.querySelectorAll("#spectra .legend button")]
              .filter((button) => /^±/.test(button.textContent))
              .map((button) => Number(button.querySelector("rect").getAttribute("fill-opacity")))"""
        )
        assert sorted(swatches) == sorted(shades)
        grey = 0.4  # linear luminance of the tolerance's grey is about 0.13; this is its lightness
        light, dark = (1 - own * (1 - grey) for own in (shades[1], shades[0]))
        assert light - dark > 0.1


@pytest.mark.parametrize("width", [1400, 390])
def test_buttons_of_a_chart_lie_beside_its_legend_and_its_drawing(browser, lab, width):
    crossing = """[...document.querySelectorAll("figure.chart")].filter((figure) => {
      const tools = figure.querySelector(".chart-tools").getBoundingClientRect();
      return [...figure.querySelectorAll(".legend, .drawing, figcaption")].some((other) => {
        const box = other.getBoundingClientRect();
        return box.width && box.left < tools.right && tools.left < box.right
          && box.top < tools.bottom - 0.5 && tools.top < box.bottom - 0.5;
      });
    }).map((figure) => figure.id)"""
    with page_of(browser, lab, width=width) as page:
        addresses = (f"/impacts/{a_shot(lab)}", spectra_address(lab), "/compare?campaign=rehearsal")
        for address in addresses:
            at(page, address)
            assert page.locator(".chart-tools").count() > 0
            assert page.evaluate(crossing) == [], address


def test_a_switched_curve_leaves_both_plots_and_their_files(browser, lab):
    with page_of(browser, lab, width=1400) as page:
        at(page, spectra_address(lab, 2))
        entry = page.locator("#spectra .legend button", has_text="impact").first
        name = entry.inner_text()
        entry.click()
        shown = page.evaluate(
            f"{LEVELS}.charts.map((chart) => chart.shown().map((own) => own.name))"
        )
        assert all(name not in names and len(names) > 3 for names in shown)
        assert name not in page.evaluate(f"{PAPER}.shown().map((own) => own.name)")
        page.evaluate(f"{LEVELS}.charts[0].zoom({{ x: [300, 900] }})")
        address = page.url
        tools = page.locator("#spectra .chart-tools")
        files = {}
        for kind in ("CSV", "SVG", "PNG"):
            with page.expect_download() as download:
                tools.get_by_role("button", name=kind, exact=True).click()
            files[kind] = Path(download.value.path()).read_bytes()
        head, *rows = files["CSV"].decode().splitlines()
        assert name not in head and "difference (dB)" in head and "shock response (g)" in head
        frequencies = [float(row.split(",")[0]) for row in rows]
        assert frequencies and all(300 <= hz <= 900 for hz in frequencies)
        drawing = files["SVG"].decode()
        assert name not in drawing and drawing.count('class="drawing"') == 2
        assert "var(--" not in drawing
        assert files["PNG"].startswith(b"\x89PNG")
        page.goto("about:blank")
        page.goto(address)
        page.wait_for_selector("#spectra [data-drawn=yes]")
        restored = f"{LEVELS}.charts.map((chart) => chart.range.x)"
        until(lambda: page.evaluate(restored)[0][0] > 299, 5 * SLOW)
        assert page.evaluate(restored) == [pytest.approx([300, 900])] * 2
        hidden = page.locator("#spectra .legend button[aria-pressed=false]").all_inner_texts()
        assert hidden == [name]
        assert name not in page.evaluate(f"{PAPER}.shown().map((own) => own.name)")
        page.evaluate(f"{PAPER}.zoom({{ x: [400, 800] }})")
        assert "paper.x=400" in page.url and "spectra.x" not in page.url
        assert "spectra.hide=" in page.url


def test_one_pulse_is_a_point_and_no_box(browser, lab):
    figure = """{ title: "Boxes", description: "", cursor: "nearest", height: 120, lines: [],
      regions: [], labels: [], legend: ["a"], equal_decades: false,
      x: { heading: "tip", unit: "", scale: "linear", categories: ["one"], limits: [-0.5, 0.5] },
      y: { heading: "error (%)", unit: "%", scale: "linear", categories: [], limits: [0, 6] },
      series: [{ kind: "boxes", name: "a", detail: "", role: "c0", opacity: 1, position: [0],
                 boxes: [null], samples: [[3]], width: 0.6 }] }"""
    with page_of(browser, lab, width=1400) as page:
        at(page, "/compare?campaign=rehearsal")
        page.evaluate(f"pyroshock.draw(document.querySelector('#overlay .plot'), {figure})")
        paths = page.evaluate(
            """[...document.querySelectorAll("#overlay .drawing path[stroke='var(--c0)']")]
              .map((path) => path.getAttribute("d")).filter(Boolean)"""
        )
        assert len(paths) == 1 and re.fullmatch(r"M[\d.]+ [\d.]+h0", paths[0])
        words = page.locator("#overlay .drawing text").all_text_contents()
        assert "error (%)" in words  # a low chart alone keeps the heading of its axis
