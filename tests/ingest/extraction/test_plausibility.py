"""What the rows say is held against the pulses, recordings against each other; a hit without a row
is told."""

from __future__ import annotations

import re

import numpy as np
import pytest
from pyroshock.ingest.extraction.impulse_plausibility import check_impulse
from pyroshock.ingest.extraction.pulses import find_hits
from pyroshock.ingest.folder.unit_mistakes import unit_mistakes
from pyroshock.signals.units import to_si
from support.records.campaigns import (
    FS_HZ,
    Blow,
    force_record,
    hammer_campaign,
    hammer_rows,
    recording_name,
    write_recording,
    write_runs,
)
from support.stores.stores import ingest_report

#: Head of the campaigns' hammer, and a hit of 1000 N: its impulse is the sum of its samples.
MASS_KG, STEEL_DENSITY = 0.32, 7800.0
BLOW = Blow(0.05, 1000.0, 0.8e-3)


def findings(folder, url):
    return [f for f in ingest_report(url, folder)[0]["findings"] if f["severity"] != "note"]


def campaign(path, **cells):
    """One hit; also its impulse in N s."""
    folder = hammer_campaign(path, 1)
    write_runs(folder, [{**hammer_rows(1, 1)[0], **cells}])
    force = force_record((BLOW,), np.random.default_rng(3))
    write_recording(folder / recording_name(1), {"force": force})
    return folder, float(force_record((BLOW,), np.random.default_rng(3)).sum() / 51200.0)


@pytest.mark.parametrize(
    ("ratio", "severity"),
    [
        (0.2, "reject"),
        (0.4, "warning"),
        (0.7, None),
        (1.0, None),
        (1.5, None),
        (2.0, None),
        (4.0, "warning"),
        (8, "reject"),
    ],
)
def test_impulse_is_held_against_mass_and_velocity(sqlite_url, tmp_path, ratio, severity):
    _, impulse_n_s = campaign(tmp_path / "a")
    folder, _ = campaign(tmp_path / "b", impact_velocity_m_s=impulse_n_s / MASS_KG / ratio)
    found = findings(folder, sqlite_url)
    assert [(f["check"], f["severity"]) for f in found] == (
        [] if severity is None else [("implausible-impulse", severity)]
    )
    assert all(f["channel"] == "force" and "0.32 kg" in f["message"] for f in found)


@pytest.mark.parametrize(("radius_mm", "doubted"), [(0.0125, True), (12.5, False)])
def test_needle_for_a_tip_is_doubted(sqlite_url, tmp_path, radius_mm, doubted):
    folder, _ = campaign(tmp_path / "a", tip_radius_mm=radius_mm)
    assert [f["check"] for f in findings(folder, sqlite_url)] == ["implausible-tip"] * doubted


def test_one_recording_under_two_runs_is_doubted(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c", 2)
    same = force_record((BLOW,), np.random.default_rng(3))
    write_runs(
        folder,
        [
            {**hammer_rows(2, 1)[i], "recording": f"recordings/{name}.npz"}
            for i, name in enumerate("ab")
        ],
    )
    for name in "ab":
        np.savez(folder / "recordings" / f"{name}.npz", force=same, fs=51200.0)
    (found,) = findings(folder, sqlite_url)
    assert (found["check"], found["recording"]) == ("same-recording", "recordings/b.npz")
    assert "recordings/a.npz" in found["message"]


@pytest.mark.parametrize(("ratio", "doubted"), [(0.3, False), (0.2, True)])
def test_light_plate_takes_its_share_of_the_lower_limit(sqlite_url, tmp_path, ratio, doubted):
    """A plate as heavy as the hammer's head, which flies off with half of the momentum: half of the
    limit, 0.25."""
    _, impulse_n_s = campaign(tmp_path / "a")
    folder, _ = campaign(tmp_path / "b", impact_velocity_m_s=impulse_n_s / MASS_KG / ratio)
    card = folder / "campaign.toml"
    side_m = 0.1
    thickness_m = MASS_KG / (side_m**2 * STEEL_DENSITY)
    outline = f"[[0, 0], [{side_m}, 0], [{side_m}, {side_m}], [0, {side_m}]]"
    plate = (
        f'[bench.plate]\nmaterial = "steel"\nthickness_m = {thickness_m}\noutline_m = {outline}\n'
    )
    card.write_text(card.read_text().replace("[channels", plate + "\n[channels", 1))
    told = findings(folder, sqlite_url)
    assert [f["check"] for f in told] == ["implausible-impulse"] * doubted
    assert all("0.5 to 2 are possible" in f["message"] for f in told)


@pytest.mark.parametrize(("ratio", "doubted"), [(3.6, False), (5.0, True)])
def test_cells_behind_an_anvil_may_show_twice_the_impulse(ratio, doubted):
    """A mass on a spring that is struck pushes with twice the impulse before it pulls."""
    (pulse,) = find_hits(force_record((BLOW,), np.random.default_rng(3)), FS_HZ).pulses
    velocity_m_s = pulse.impulse_n_s / (ratio * MASS_KG)
    anvil = check_impulse(pulse, MASS_KG, velocity_m_s, 0, "force_1", held=False, behind_anvil=True)
    bare = check_impulse(pulse, MASS_KG, velocity_m_s, 0, "force_1", held=False)
    assert (anvil is not None, bare is not None) == (doubted, True)


def signed_campaign(path, signs):
    """A recording of one hit for each sign."""
    folder = hammer_campaign(path, len(signs))
    write_runs(folder, hammer_rows(len(signs), 1))
    for number, sign in enumerate(signs, 1):
        force = force_record((BLOW,), np.random.default_rng(number))
        write_recording(folder / recording_name(number), {"force": sign * force})
    return folder


@pytest.mark.parametrize(
    ("signs", "doubted", "word"),
    [
        ((1, 1, 1), (), ""),
        ((-1, -1), (), ""),
        ((1, -1, 1), (2,), "negative"),
        ((-1, 1, -1), (2,), "positive"),
        ((1, -1), (2,), "negative"),
    ],
)
def test_force_of_another_sign_than_the_others_is_doubted(
    sqlite_url, tmp_path, signs, doubted, word
):
    told = findings(signed_campaign(tmp_path / "c", signs), sqlite_url)
    assert [(f["check"], f["recording"]) for f in told] == [
        ("force-sign", recording_name(n)) for n in doubted
    ]
    assert all(
        f["channel"] == "force" and f"the force is {word} here" in f["message"] for f in told
    )


def test_doubt_of_a_sign_follows_the_campaign_as_it_grows(sqlite_url, tmp_path):
    """One negative beside one positive is doubted; with two more negative ones, the positive one
    is."""
    folder = signed_campaign(tmp_path / "c", (1, -1, -1, -1))
    rows = hammer_rows(4, 1)
    write_runs(folder, rows[:2])
    assert [f["recording"] for f in findings(folder, sqlite_url)] == [recording_name(2)]
    write_runs(folder, rows)
    assert [f["recording"] for f in findings(folder, sqlite_url)] == [recording_name(1)]


#: Three hits of known time, peak and width.
THREE = (Blow(0.05, 1000.0, 0.8e-3), Blow(0.2, 1500.0, 0.8e-3), Blow(0.35, 900.0, 0.8e-3))


def report_of(folder, url, made, rows):
    write_runs(folder, rows)
    write_recording(
        folder / recording_name(1), {"force": force_record(made, np.random.default_rng(3))}
    )
    return ingest_report(url, folder)


def told_hits(finding):
    """(time in s, peak in N) of each hit that a message names."""
    hits = re.findall(r"([\d.]+) N at ([\d.]+) s", finding["message"])
    return [
        (pytest.approx(float(time), abs=1e-3), pytest.approx(float(peak), rel=0.01))
        for peak, time in hits
    ]


def left_out(report):
    return [f for f in report["findings"] if f["check"] == "hit-without-row"]


def test_third_hit_of_two_rows_is_told(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c", 1)
    report, hit_findings = report_of(folder, sqlite_url, THREE, hammer_rows(1, 2))
    assert report["impacts"] == 2
    (finding,) = left_out(report)
    assert finding["recording"] == recording_name(1)
    assert finding["severity"] == "warning"  # 900 N beside 1000 N: which is whose is a guess
    assert "3 hits" in finding["message"]
    assert "2 rows" in finding["message"]
    assert told_hits(finding) == [(0.3504, 900.0)]
    assert "warning: hit-without-row (1)" in hit_findings


def test_hits_beside_the_one_of_a_reported_velocity_are_told(sqlite_url, tmp_path):
    """A velocity belongs to one hit, so that the row cannot count on."""
    folder = hammer_campaign(tmp_path / "c", 1)
    rows = [{**hammer_rows(1, 1)[0], "impact_velocity_m_s": 1.0}]
    report, _ = report_of(folder, sqlite_url, THREE, rows)
    assert report["impacts"] == 1
    (finding,) = left_out(report)
    assert told_hits(finding) == [(0.0504, 1000.0), (0.3504, 900.0)]


def test_small_hit_is_a_note(sqlite_url, tmp_path):
    """A touch far below the hits that have rows is worth knowing, and casts no doubt on them."""
    folder = hammer_campaign(tmp_path / "c", 1)
    made = (THREE[0], THREE[1], Blow(0.35, 200.0, 0.8e-3))
    report, _ = report_of(folder, sqlite_url, made, hammer_rows(1, 2))
    assert [f["severity"] for f in left_out(report)] == ["note"]


@pytest.mark.parametrize("hits", [1, 3])
def test_as_many_rows_as_hits_have_nothing_to_tell(sqlite_url, tmp_path, hits):
    folder = hammer_campaign(tmp_path / "c", 1)
    report, _ = report_of(folder, sqlite_url, THREE[:hits], hammer_rows(1, hits))
    assert report["impacts"] == hits
    assert left_out(report) == []


def test_touch_before_the_hit_is_told(sqlite_url, tmp_path):
    """Within a tenth of a second two contacts are one impact; the smaller one is told also where it
    came first."""
    folder = hammer_campaign(tmp_path / "c", 1)
    early, hit = Blow(0.05, 500.0, 0.8e-3), Blow(0.09, 1000.0, 0.8e-3)
    report, _ = report_of(folder, sqlite_url, (early, hit), hammer_rows(1, 1))
    assert report["impacts"] == 1
    (finding,) = [f for f in report["findings"] if f["check"] == "double-hit"]
    assert told_hits(finding) == [(0.0504, 500.0)]
    assert "before" in finding["message"]


def test_ringing_before_the_hit_is_no_touch():
    """A band-limited impulse rings before its peak (sin x / x: 12.8 % upwards, 21.7 %
    downwards)."""
    time = np.arange(-2000, 2000)
    (pulse,) = find_hits(1000.0 * np.sinc(time / 4.0), FS_HZ).pulses
    assert pulse.peak_force_n == pytest.approx(1000.0)
    assert pulse.earlier_touches == ()


@pytest.mark.parametrize("quantity", ["force", "acceleration", "velocity", "pressure"])
def test_a_mistake_of_unit_is_off_by_the_ratio_of_both_units(quantity: str) -> None:
    unit_findings = [
        (factor, re.fullmatch("values in (.+) where (.+) is declared", text))
        for factor, text in unit_mistakes(quantity)
    ]
    units = [(factor, *match.groups()) for factor, match in unit_findings if match]
    assert len(units) >= 6
    for factor, written, declared in units:
        assert factor == pytest.approx(
            to_si(declared, quantity)[0] / to_si(written, quantity)[0], rel=1e-6
        )


def test_a_gain_can_be_forgotten_or_too_much() -> None:
    gains = {factor for factor, text in unit_mistakes("acceleration") if "gain" in text}
    assert gains == {10.0, 100.0, 0.1, 0.01}
