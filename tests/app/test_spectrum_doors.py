"""One shot has one spectrum: in the command, the library, the API, the pages, and the figures that
an ingest stores."""

from __future__ import annotations

import io
import json
from base64 import b64encode

import numpy as np
import pandas as pd
import pyroshock as ps
import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.operations.impacts.overlays import spectrum_overlay
from pyroshock.schema.campaigns import Configuration
from pyroshock.schema.impacts import Impact
from pyroshock.schema.session import Writer, open_store
from pyroshock.signals.channel import Sensor
from pyroshock.signals.shock_figures import shock_figures, summary_lines
from support.processes.web_client import post_json, token, window
from support.stores.recorded import add_recording

RATE = 50_000.0
LINES = np.array(summary_lines(10_000, RATE))
PEAK, OFFSET = 1000.0, 6.0


def ringing(at_s: float, seconds: float = 0.2) -> np.ndarray:
    since = np.maximum(np.arange(round(seconds * RATE)) / RATE - at_s, 0)
    return (
        PEAK
        * np.exp(-150 * since)
        * (np.sin(2 * np.pi * 900 * since) + 0.4 * np.sin(2 * np.pi * 3100 * since))
    )


@pytest.fixture(scope="module")
def record():
    return ringing(0.05) + OFFSET + np.random.default_rng(1).normal(0, 0.2, 10_000)


@pytest.fixture(scope="module")
def doors(record, tmp_path_factory):
    """Each door's spectrum at `LINES` and what it took off."""
    folder = tmp_path_factory.mktemp("doors")
    file = folder / "shot.csv"
    times = np.arange(record.size) / RATE
    columns = np.stack([times, record], axis=1)
    np.savetxt(file, columns, delimiter=",", header="time_s,acc_m_s2", comments="", fmt="%.12g")
    lines = ",".join(repr(float(line)) for line in LINES)
    printed = CliRunner().invoke(main, ["srs", str(file), "--frequencies", lines, "--json"])
    command = json.loads(printed.stdout)
    series = ps.srs(pd.Series(record, index=times), frequencies=LINES)
    with window(f"sqlite:///{folder / 'window.db'}", works=False) as (client, _):
        body = {"acceleration_m_s2": record.tolist(), "sampling_rate_hz": RATE}
        body |= {"frequency_hz": LINES.tolist(), "rest": "", "hit": ""}
        answer = post_json(client, "/api/srs", body).json()
        sent = {"name": "shot.csv", "content": b64encode(file.read_bytes()).decode()}
        content = post_json(
            client, "/api/srs/recording", {"file": sent, "frequencies": lines}
        ).json()
    figures = shock_figures(record, RATE)
    with open_store(f"sqlite:///{folder / 'lab.db'}", Writer("test", "0"), create=True) as store:
        sensor = Sensor("plate", "acceleration", "m/s2", position="plate")
        recording, _ = add_recording(store, {sensor: record}, RATE)
        with store.writing() as session:
            session.add(Configuration(id=1, fingerprint="1"))
            session.flush()
            session.add(
                Impact(
                    id=1,
                    run=1,
                    repetition=1,
                    campaign_id=1,
                    configuration_id=1,
                    recording_id=recording,
                )
            )
        with store.reading() as session:
            page = spectrum_overlay(session, [1], frequency_hz=LINES).spectra[0].spectrum.maximax
    return {
        "command": (np.array(command["maximax"]), command["rest"]["removed_m_s2"]),
        "library": (series.to_numpy(), series.attrs["rest"]),
        "content": (np.array(content["maximax"]), content["rest"]["removed_m_s2"]),
        "API": (np.array(answer["maximax"]), answer["rest"]["level_m_s2"]),
        "page": (page, None),
        "stored figures": (np.array(figures.srs_maximax_m_s2), figures.rest_m_s2),
    }


@pytest.mark.parametrize("door", ["library", "API", "content", "page", "stored figures"])
def test_every_door_gives_the_spectrum_of_the_command(doors, door):
    """The figures that an ingest stores take means for low lines, which is within a percent."""
    maximax, rest = doors[door]
    expected, removed = doors["command"]
    np.testing.assert_allclose(maximax, expected, rtol=0.01 if door == "stored figures" else 1e-9)
    assert rest is None or rest == pytest.approx(removed, rel=1e-9)


def test_an_offset_changes_no_line_and_is_told(record, doors):
    """0.6 % of the peak, which would change the line at 10 Hz by more than half."""
    maximax, removed = doors["command"]
    assert removed == pytest.approx(OFFSET, abs=0.05)
    clean = ps.srs(record - OFFSET, RATE, frequencies=LINES, rest="none")
    np.testing.assert_allclose(maximax, clean, rtol=0.02)
    spectrum_with_rest = ps.srs(record, RATE, frequencies=LINES, rest="none")
    assert (
        spectrum_with_rest.attrs["rest"] == 0 and spectrum_with_rest.iloc[0] > 1.5 * clean.iloc[0]
    )
    chosen = ps.srs(record, RATE, frequencies=LINES, rest="5ms:40ms")
    np.testing.assert_allclose(chosen, clean, rtol=0.02)
    for wrong in ("5ms", "40ms:5ms", "5:40"):
        with pytest.raises(ps.InvalidValueError, match="rest is"):
            ps.srs(record, RATE, rest=wrong)


def test_an_uploaded_file_is_answered_with_its_spectrum_and_its_record(record, tmp_path):
    content = io.BytesIO()
    np.savez(content, fs=RATE, acc_m_s2=record)
    with window(f"sqlite:///{tmp_path / 'window.db'}", works=False) as (client, _):
        form = {"frequencies": "100,1000", "csrf": token(client)}
        sent = [("file.file", ("shot.npz", content.getvalue()))]
        answer = client.post("/ask/srs", data=form, files=sent)
    spectrum = ps.srs(record, RATE, frequencies=[100.0, 1000.0])
    assert answer.status_code == 200 and 'id="figure-1-2"' in answer.text
    assert f"{spectrum.iloc[1] / 9.80665:.4g}" in answer.text


def test_a_record_of_several_hits_asks_which(tmp_path):
    both = ringing(0.1, 1.0) + 0.5 * ringing(0.6, 1.0) + OFFSET
    with pytest.raises(
        ps.InvalidValueError, match=r"holds 2 hits, at 0\.1, 0\.6 s; choose one with hit 1 to 2"
    ):
        ps.srs(both, RATE)
    first, second = (ps.srs(both, RATE, hit=number, frequencies=LINES[3:]) for number in (1, 2))
    np.testing.assert_allclose(second, 0.5 * first, rtol=0.02)
    assert ps.srs(both, RATE, hit="whole", frequencies=LINES[3:]).max() == pytest.approx(
        first.max(), rel=0.02
    )
    file = tmp_path / "hits.csv"
    np.savetxt(file, both, header="fs = 50000\nacc [m/s2]")
    refused = CliRunner().invoke(main, ["srs", str(file)])
    assert refused.exit_code != 0 and "choose one with --hit 1 to 2" in refused.output
    taken = CliRunner().invoke(main, ["srs", str(file), "--hit", "2", "--json"])
    assert json.loads(taken.stdout)["part"] == "hit 2 of 2, at 0.6 s"
    assert (
        "expected 1 to 2, or whole"
        in CliRunner().invoke(main, ["srs", str(file), "--hit", "3"]).output
    )
