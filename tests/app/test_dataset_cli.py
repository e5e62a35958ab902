"""The commands of `dataset`, as a laboratory uses them."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.operation_group import OperationGroup
from pyroshock.dataset.snapshot import read_snapshot
from support.stores.hammer_stores import HITS, copied, filled_store, full_campaign
from support.stores.stores import opened


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("campaigns")
    spring, autumn = (
        full_campaign(root / "a"),
        full_campaign(root / "b", "autumn", recordings=1, seed=2),
    )
    return filled_store(root, spring, autumn)


@pytest.fixture
def url(filled, tmp_path) -> str:
    return copied(filled, tmp_path)


def run(url: str, *words: str | Path):
    result = CliRunner().invoke(OperationGroup("dataset"), [*map(str, words), "--db", url])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def done(url: str, *words: str | Path):
    result = run(url, *words)
    assert result.exit_code == 0, result.stderr
    return result


def as_json(url: str, *words: str | Path):
    return json.loads(done(url, *words, "--json").stdout)


def test_build_tells_the_contract(url):
    told = as_json(url, "build", "d", "--from", "spring")
    assert {"name", "hash", "pulses", "train", "test", "left_out"} == told.keys()
    assert (told["name"], told["pulses"], told["train"], told["test"]) == ("d", 4 * HITS, 16, 4)
    with opened(url) as store:
        assert read_snapshot(store, "d").hash == told["hash"]


@pytest.mark.parametrize(
    "words", [["--from", "spring", "autumn"], ["--from", "spring", "--from", "autumn"]]
)
def test_several_campaigns_are_split_as_asked(url, words):
    built = as_json(url, "build", "d", *words, "--split", "campaign=autumn")
    assert (built["pulses"], built["train"], built["test"]) == (5 * HITS, 4 * HITS, HITS)
    assert (
        "frozen already under the name d; nothing was added"
        in done(url, "build", "e", *words).stderr
    )


@pytest.mark.parametrize("words", [["list"], []])
def test_list(url, words):
    assert "no datasets yet" in done(url, *words).stdout
    done(url, "build", "d", "--from", "spring")
    (row,) = as_json(url, *words)
    assert (row["name"], row["pulses"], row["campaigns"]) == ("d", 4 * HITS, ["spring"])
    assert row["hash"][:12] in done(url, *words).stdout


def test_show_tells_splits_ranges_and_correlations(url, tmp_path):
    done(url, "build", "d", "--from", "spring", "autumn")
    told = as_json(url, "show", "d", "--plot", tmp_path / "d.png")
    counts = {row["split"]: (row["train"], row["test"]) for row in told["splits"]}
    assert counts["repetitions"] == (20, 5) and counts["campaign=autumn"] == (20, 5)
    assert len(told["correlation"]) == len(told["ranges"]) == 13
    assert (tmp_path / "d.png").read_bytes().startswith(b"\x89PNG")
    text = done(url, "show", told["hash"][:10]).stdout
    assert "material=steel" in text and "nothing was left out" in text
    ranges = {
        line.partition("  ")[0]: line.split()[-5:]
        for line in text.partition("predictor ")[2].splitlines()
    }
    (radius,) = [row for row in told["ranges"] if row["predictor"] == "tip_radius"]
    assert radius["unit"] == "m" and ranges["tip radius"][0] == "mm"
    assert float(ranges["tip radius"][-1]) == pytest.approx(1e3 * radius["max"])
    assert ranges["tip Young's modulus"][0] == "GPa" and ranges["tip yield strength"][0] == "MPa"
    in_si = done(url, "show", "d", "--units", "si").stdout
    assert re.search(r"^tip radius +m +\d", in_si, re.MULTILINE)


def test_trace_from_an_exported_key(url, tmp_path):
    done(url, "build", "d", "--from", "spring")
    done(url, "export", "d", "--out", tmp_path / "d.csv")
    row = pd.read_csv(tmp_path / "d.csv").iloc[7]
    told = as_json(url, "trace", "d", row["key"])
    assert (told["campaign"], told["run"], told["repetition"]) == (
        row["campaign"],
        row["run"],
        row["repetition"],
    )
    assert told["recording"] == "recordings/test-02.mat"
    assert told["recording_sha256"] in done(url, "trace", "d", row["key"][:8]).stdout
    assert told["recording_sha256"] in [file["sha256"] for file in as_json(url, "trace", "d")]


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_export_is_exact(url, tmp_path, suffix):
    done(url, "build", "d", "--from", "spring")
    out = tmp_path / f"d.{suffix}"
    done(url, "export", "d", "--out", out)
    of_text = csv.DictReader(out.read_text().splitlines()) if suffix == "csv" else ()
    rows = list(of_text) or pd.read_parquet(out).to_dict("records")
    with opened(url) as store:
        table = read_snapshot(store, "d").table
    assert [float(row["force_07_n"]) for row in rows] == table.force_n[:, 6].tolist()
    assert [float(row["impact_velocity_m_s"]) for row in rows] == table.column(
        "impact_velocity"
    ).tolist()
    assert [rows[0]["insulator"], rows[HITS]["insulator"]] == ["none", "polymeric"]
    assert [path.name for path in tmp_path.glob("d.*")] == [out.name]


@pytest.mark.parametrize(("words", "said"), [
    (("build", "d", "--from", "winter"), "no campaign 'winter'"),
    (("build", "d", "--from", "spring", "--predictors", "sled"), "no predictors 'sled'"),
    (("build", "d", "--from", "spring", "--predictors", "gun"), "kind 'gun', not spring: hammer"),
    (("build", "d", "--from", "spring", "--predictors", "absent.toml"), "absent.toml"),
    (("build", "d", "--from", "spring", "--extraction", "beef"), "no extractions 'beef'"),
    (("build", " ", "--from", "spring"), "name is ' '; expected a text"),
    (("show", "x"), "no dataset 'x' in the store; there: none yet"),
    (("trace", "x", "abcd"), "no dataset 'x'"),
    (("export", "x", "--out", "x.csv"), "no dataset 'x'"),
])  # fmt: skip
def test_error_is_one_line(url, words, said):
    result = run(url, *words)
    assert result.exit_code == 2 and result.stderr.count("\n") == 1 and said in result.stderr


def test_unknown_split_freezes_nothing_and_unknown_suffixes_are_refused(url, tmp_path):
    result = run(url, "build", "d", "--from", "spring", "--split", "halves")
    assert (
        result.exit_code == 2
        and "expected one of repetitions" in result.stderr
        and as_json(url, "list") == []
    )
    done(url, "build", "d", "--from", "spring")
    assert (
        "ends in .csv or .parquet" in run(url, "export", "d", "--out", tmp_path / "d.xlsx").stderr
    )
    assert "cannot draw 'd.txt'" in run(url, "show", "d", "--plot", tmp_path / "d.txt").stderr
