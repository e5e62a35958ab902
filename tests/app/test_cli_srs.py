"""`pyroshock srs`: any recording alone, as a person or a script calls it."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.operations.impacts.spectra import parse_lines
from pyroshock.signals.checks import SPECTRUM_CHECKS
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from pyroshock.twin.srs.target_csv import read_target

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "examples/modal-hammer-hit/recordings/acceleration.lvm"
PAGE = (ROOT / "docs/explanation/srs.md").read_text(encoding="utf-8")
G = 9.80665
KEYS = {
    "unit", "frequency_hz", "maximax", "positive", "negative", "primary", "residual",
    "pseudo_velocity_m_s", "checks",
}  # fmt: skip
RATE = 20_000.0
LINES = np.array([100.0, 500.0, 1000.0])


def call(*words: object) -> Result:
    result = CliRunner().invoke(main, ["srs", *map(str, words)])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def as_json(*words: object):
    result = call(*words, "--json")
    assert result.exit_code in (0, 1), result.stderr
    return json.loads(result.stdout)


def refusal(*words: object) -> str:
    result = call(*words)
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith("pyroshock: ") and result.stderr.count("\n") == 1
    return result.stderr


def pulse() -> np.ndarray:
    """Half-sine of 100 (whatever unit), 5 ms, in the middle of half a second."""
    x = np.zeros(10_000)
    x[4000:4101] = 100 * np.sin(np.pi * np.arange(101) / 100)
    return x


def table(path: Path, header: str = "time_s,acc [g]", **more: np.ndarray) -> Path:
    columns = [np.arange(10_000) / RATE, pulse(), *more.values()]
    with path.open("w", encoding="utf-8") as file:
        file.write(",".join([header, *more]) + "\n")
        np.savetxt(file, np.stack(columns, axis=1), delimiter=",", fmt="%.10g")
    return path


def spec(path: Path, factor: float = 1.0) -> Path:
    """The pulse's own spectrum as a target, times a factor."""
    maximax = shock_response_spectrum(G * pulse(), RATE, LINES).maximax * factor
    rows = [f"{hz},{level}" for hz, level in zip(LINES, maximax, strict=True)]
    path.write_text("\n".join(["frequency_hz,level_m_s2", *rows]) + "\n")
    return path


def test_json_is_the_spectrum_in_si_of_the_record_and_the_oscillators_it_names(tmp_path):
    spectrum_json = as_json(table(tmp_path / "a.csv"), "--frequencies", "100", "--damping", "0.02")
    facts = {
        "sampling_rate_hz": RATE,
        "samples": 10_000,
        "start_s": 0.0,
        "duration_s": 0.5,
        "q": 25.0,
    }
    assert {key: spectrum_json[key] for key in facts} == facts and spectrum_json[
        "damping_ratio"
    ] == 0.02
    spectrum_json = as_json(table(tmp_path / "a.csv"), "--frequencies", "100,500,1000")
    exact = shock_response_spectrum(G * pulse(), RATE, LINES)
    assert (
        set(spectrum_json) >= KEYS
        and spectrum_json["unit"] == "m/s2"
        and spectrum_json["checks"] == []
    )
    np.testing.assert_array_equal(spectrum_json["frequency_hz"], LINES)
    for name in ("maximax", "positive", "negative", "primary", "residual", "pseudo_velocity_m_s"):
        np.testing.assert_allclose(spectrum_json[name], getattr(exact, name), rtol=1e-9)


def test_checks_have_evidence(tmp_path):
    path = tmp_path / "a.csv"
    np.savetxt(path, np.clip(pulse(), None, 50), header="fs = 20000\nacc [g]")
    checks = as_json(path, "--frequencies", "100", "--range", "50g")["checks"]
    assert all(set(check) == {"check", "severity", "message", "evidence"} for check in checks)
    (saturation,) = (check for check in checks if check["check"] == "saturation")
    assert saturation["severity"] == "reject" and saturation["evidence"]["level"] == pytest.approx(
        50 * G
    )


def test_the_whole_rule_of_a_standard_decides(tmp_path):
    """5 dB low everywhere lies within the tolerance of NASA-STD-7003A, and no line lies above the
    nominal."""
    low = (table(tmp_path / "a.csv"), "--target", spec(tmp_path / "t.csv", 10 ** (5 / 20)))
    target = as_json(*low, "--tolerance", "nasa-std-7003")["target"]
    lines = len(target["frequency_hz"])
    assert target["within"] and not target["met"] and target["rule"]["name"] == "NASA-STD-7003A"
    assert [(rule["lines"], rule["required"], rule["met"]) for rule in target["rules"]] == [
        (lines, lines, True),
        (0, -(-lines // 2), False),
    ]
    result = call(*low, "--tolerance", "nasa-std-7003")
    assert result.exit_code == 1 and "missed" in result.stdout
    assert (
        f"at the level or above: 0 of {lines} lines, {-(-lines // 2)} required, not met"
        in result.stdout
    )
    assert call(*low, "--tolerance", "6dB").exit_code == 0


@pytest.mark.parametrize("rate", ["20000", "20000Hz", "20 kHz"])
def test_a_file_without_a_clock_takes_the_given_rate(tmp_path, rate):
    np.savetxt(tmp_path / "bare.txt", pulse())
    np.save(tmp_path / "bare.npy", pulse())
    exact = shock_response_spectrum(G * pulse(), RATE, LINES)
    for name in ("bare.txt", "bare.npy"):
        told = as_json(
            tmp_path / name, "--unit", "g", "--rate", rate, "--frequencies", "100,500,1000"
        )
        assert told["sampling_rate_hz"] == RATE
        np.testing.assert_allclose(told["maximax"], exact.maximax, rtol=1e-9)


def test_rate_and_channel_are_the_files_and_damping_and_q_one_setting(tmp_path):
    file = table(tmp_path / "a.csv")
    assert as_json(file, "--rate", RATE, "--frequencies", "100")["sampling_rate_hz"] == RATE
    assert as_json(file, "--q", 25)["maximax"] == as_json(file, "--damping", 0.02)["maximax"]
    others = {"force [N]": np.arange(10_000), "top [mm]": np.arange(10_000)}
    assert as_json(table(tmp_path / "one.csv", **others))["channel"] == "acc"
    file = table(tmp_path / "a.csv", **{"bcc [g]": 2 * pulse()})
    assert "acc [g], bcc [g]" in refusal(file)
    twice, once = (as_json(file, "--channel", name)["maximax"] for name in ("bcc", "acc"))
    np.testing.assert_allclose(twice, 2 * np.array(once), rtol=1e-9)
    assert "no channel 'dcc'; the file has: acc, bcc" in refusal(file, "--channel", "dcc")


def test_unit_and_channel_are_the_files_or_asked_for(tmp_path):
    told = as_json(EXAMPLE, "--frequencies", "100:5000")
    assert told["channel"] == "Acceleration (Trigger)" and told["sampling_rate_hz"] == 50_000
    assert max(told["maximax"]) > 35.5 * G  # the recorded peak
    file = table(tmp_path / "a.csv", "time_s,acc")
    assert "give it, such as --unit g" in refusal(file)
    in_g, in_si = (as_json(file, "--unit", unit)["maximax"] for unit in ("g", "m/s2"))
    np.testing.assert_allclose(in_g, G * np.array(in_si), rtol=1e-12)


@pytest.mark.parametrize(("header", "words", "said"), [
    ("time_s,acc [m/s2]", "--unit g", "is in 'm/s2' by the file, in 'g' by --unit"),
    ("time_s,acc_m_s2", "--unit g", "is in 'm/s2' by the file, in 'g' by --unit"),
    ("time_s,acc [N]", "", "no channel is known to be an acceleration"),
    ("time_s,acc [N]", "--channel acc", "is in 'N', which is no acceleration"),
    ("time_s,acc", "--unit splat", "unknown unit 'splat'"),
    ("time_s,acc [g]", "--tolerance 3dB", "goes with --target"),
    ("time_s,acc [g]", "--frequencies 100,10000", "half the sampling rate"),
    ("time_s,acc [g]", "--rate 48000", "sampling rate of 20000.0 Hz, and 48000.0 Hz is given"),
    ("time_s,acc [g]", "--rate fast", "--rate is 'fast'; expected a number with a unit"),
    ("time_s,acc [g]", "--rate=-1", "--rate is '-1'; expected a number above zero"),
    ("time_s,acc [g]", "--rate nan", "--rate is 'nan'; expected a number above zero"),
    ("time_s,acc [g]", "--rate '5 m'", "--rate is '5 m'; expected a unit such as 'kHz'"),
    ("time_s,acc [g]", "--q 25 --damping 0.02", "expected one of them"),
])  # fmt: skip
def test_what_contradicts_the_file_or_itself_is_refused(tmp_path, header, words, said):
    assert said in refusal(table(tmp_path / "a.csv", header), *shlex.split(words))


@pytest.mark.parametrize(("factor", "code"), [(1.0, 0), (1.9, 0), (0.51, 0), (2.1, 1), (0.49, 1)])
def test_exit_code_tells_whether_the_target_is_met(tmp_path, factor, code):
    target = spec(tmp_path / "t.csv", factor)
    words = (
        table(tmp_path / "a.csv"),
        "--target",
        target,
        "--tolerance",
        "6dB",
        "--frequencies",
        "100,500,1000",
    )
    assert call(*words).exit_code == code
    told = as_json(*words)["target"]
    assert told["within"] == (code == 0)
    np.testing.assert_allclose(told["error_db"], -20 * np.log10(factor), atol=1e-5)


def test_tolerance_overrides_and_a_written_spectrum_is_a_target(tmp_path):
    words = (table(tmp_path / "a.csv"), "--target", spec(tmp_path / "t.csv", 1 / 1.5))
    assert call(*words).exit_code == 0
    assert "compared from 100 to 500 Hz only" in call(*words, "--frequencies", "100,500").stderr
    assert call(*words, "--tolerance", "3dB").exit_code == 1
    assert "expected one such as 6dB" in refusal(*words, "--tolerance", "3")
    file, out = table(tmp_path / "a.csv"), tmp_path / "spectrum.csv"
    spectrum_json, read = as_json(file, "--out", out), read_target(out)
    np.testing.assert_allclose(read.level_m_s2, spectrum_json["maximax"], rtol=1e-12)
    again = as_json(file, "--target", out, "--tolerance", "0.000001dB")
    assert again["target"]["within"] and again["frequency_hz"] == spectrum_json["frequency_hz"]


def test_table_shows_lines_moments_and_findings_and_leaves_the_store_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ("--frequencies", "100,500,8000", "--range", "100g", "--db", "sqlite:///lab.db")
    result = call(table(tmp_path / "a.csv"), *words)
    assert not (tmp_path / "lab.db").exists()
    rows = result.stdout.splitlines()
    assert result.exit_code == 0 and any(row.startswith("rms duration (ms)") for row in rows)
    assert [row.split()[0] for row in rows if row.split()[:1] in (["100"], ["500"], ["8000"])] == [
        "100",
        "500",
        "8000",
    ]
    assert "saturation" in {row.split()[0] for row in rows if row}


def test_plots_are_drawn_and_unreadable_files_are_refused_in_one_line(tmp_path):
    file = table(tmp_path / "a.csv")
    call(file, "--plot", tmp_path / "a.png")
    call(file, "--plot", tmp_path / "b.svg", "--target", spec(tmp_path / "t.csv", 3.0))
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG") and "<svg" in (
        tmp_path / "b.svg"
    ).read_text()
    assert "cannot draw" in refusal(file, "--plot", tmp_path / "a.xyz")
    holes = pulse()
    holes[5:8] = np.nan
    np.savez(tmp_path / "a.npz", fs=RATE, acc_g=holes)
    assert "3 samples that are no numbers, the first at 5" in refusal(tmp_path / "a.npz")
    assert "nowhere.csv" in refusal(tmp_path / "nowhere.csv")
    (tmp_path / "a.docx").write_text("x")
    assert "no reader for .docx" in refusal(tmp_path / "a.docx")


def test_other_formats_give_the_same_spectrum(tmp_path):
    import pandas as pd
    from scipy.io import savemat

    time, values = np.arange(10_000) / RATE, pulse()
    np.savez(tmp_path / "a.npz", fs=RATE, acc=values)
    savemat(tmp_path / "a.mat", {"fs": RATE, "acc": values})
    pd.DataFrame({"time_s": time, "acc": values}).to_parquet(tmp_path / "a.parquet")
    reference = as_json(table(tmp_path / "a.csv"), "--frequencies", "100,500,1000")["maximax"]
    for suffix in ("npz", "mat", "parquet"):
        told = as_json(tmp_path / f"a.{suffix}", "--unit", "g", "--frequencies", "100,500,1000")
        np.testing.assert_allclose(told["maximax"], reference, rtol=1e-6)


def test_lines_are_listed_or_spread():
    np.testing.assert_array_equal(parse_lines("500,100", "--frequencies"), [100, 500])
    np.testing.assert_allclose(
        parse_lines("100:800:2", "--frequencies"), 100 * 2 ** (np.arange(7) / 2)
    )
    assert parse_lines("100:800", "--frequencies").size == 19


@pytest.mark.parametrize(
    "text", ["", "abc", "100,", "-5,10", "100:50", "100:200:0", "100:200:6:1", "100:200:2.5", "inf"]
)
def test_other_lines_are_refused(text):
    with pytest.raises(ValueError, match="--frequencies is"):
        parse_lines(text, "--frequencies")


def test_page_has_every_check_a_specification_and_an_example_that_come_out(tmp_path, monkeypatch):
    rows = re.findall(r"^\| `([a-z-]+)` \|", PAGE[PAGE.index("## Checks") :], re.MULTILINE)
    names = [
        getattr(check, "__name__", "").removeprefix("check_").replace("_", "-")
        for check in SPECTRUM_CHECKS
    ]
    assert rows == names
    (tmp_path / "spec.csv").write_text(
        re.findall(r"```\n(frequency_hz,.*?)```", PAGE, re.DOTALL)[0]
    )
    read = read_target(tmp_path / "spec.csv")
    np.testing.assert_allclose(
        read.at(np.array([100.0, 1000, 10000])).level_m_s2 / G, [50, 1562.57, 1562.57], rtol=1e-5
    )
    command, shown = re.findall(
        r"```\w*\n(.*?)```", PAGE[PAGE.index("## A worked example") :], re.DOTALL
    )
    monkeypatch.chdir(ROOT)
    printed = call(*shlex.split(command)[2:]).stdout.split()
    assert [_number(word) for word in printed] == [_value(word) for word in shown.split()]


def _value(word: str) -> object:
    """A number to three digits, what else there is as it is."""
    return (
        pytest.approx(float(word), rel=1e-3) if re.fullmatch(r"-?[\d.]+(e-?\d+)?", word) else word
    )


def _number(word: str) -> object:
    return float(word) if re.fullmatch(r"-?[\d.]+(e-?\d+)?", word) else word
