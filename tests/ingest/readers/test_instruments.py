"""Files as oscilloscopes export them."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.readers import RecordingError, open_recording
from support.records.instruments import GDS, MDO3014, MSO58, PICO, PICO_ROWS, TDS500, TDS2014


@pytest.fixture
def written(tmp_path):
    def write(text, encoding="utf-8"):
        path = tmp_path / "scope.csv"
        path.write_bytes(text.encode(encoding))
        return path

    return write


def _read(path):
    with open_recording(path) as recording:
        facts = {
            c.name: (c.unit, c.sampling_rate_hz, pytest.approx(c.start_s, rel=1e-6))
            for c in recording.channels
        }
        return facts, {name: recording.read(name).tolist() for name in facts}


class TestTektronix:
    def test_settings_above_or_beside_give_units_and_rate(self, written):
        facts, samples = _read(written(MDO3014))
        assert facts == dict.fromkeys(("CH1", "D11", "D10"), ("V", 250e6, -4.72e-4))
        assert samples == {
            "CH1": [0.68, 0.28, 0.2, -1.32],
            "D11": [0, 1, 0, 0],
            "D10": [1, 0, 0, 1],
        }
        facts, samples = _read(written(MSO58))
        assert facts == {"CH1": ("V", 1e6, -2e-6), "CH2": ("A", 1e6, -2e-6)}
        assert samples["CH2"] == [1.5, 1.6, 1.7, 1.8, 1.9]
        facts, samples = _read(written(TDS2014))
        assert facts == {"CH1": ("V", 2.5e6, -5e-4)}
        assert samples["CH1"][:9] == [0.0, 0.02, 0.04, 0.06, 0.04, 0.02, 0.0, -0.02, 0.0]
        assert len(samples["CH1"]) == 20
        facts, samples = _read(written(TDS500))
        assert facts == {"CH2": (None, pytest.approx(625e6, rel=1e-6), -6.24e-8)}
        assert samples["CH2"][3] == 0.016

    def test_time_that_is_printed_coarsely_gives_way_to_the_interval(self, written):
        coarse = MSO58.replace("-2.000000e-06,", "1.000001,").replace("-1.000000e-06,", "1.000002,")
        coarse = coarse.replace("0.000000e+00,", "1.000002,").replace("2.000000e-06,", "1.000004,")
        coarse = coarse.replace("1.000000e-06,0.02", "1.000004,0.02")
        with open_recording(written(coarse)) as recording:
            assert recording.info("CH1").sampling_rate_hz == 1e6
            assert recording.info("CH1").header["time_printed_coarsely"] is True

    @pytest.mark.parametrize("text", [MDO3014, MSO58, TDS2014], ids=["MDO3014", "MSO58", "TDS2014"])
    def test_a_file_without_its_last_lines_is_refused(self, written, text):
        cut = "".join(text.splitlines(keepends=True)[:-1])
        with pytest.raises(
            RecordingError, match=r"states a Record Length of \d+ and holds \d+ lines; it is cut"
        ):
            open_recording(written(cut))

    def test_a_part_that_was_chosen_is_shorter_and_a_spectrum_is_none(self, written):
        chosen = "".join(MDO3014.replace("0.0% to", "40.0% to").splitlines(keepends=True)[:-1])
        assert len(_read(written(chosen))[1]["CH1"]) == 3
        with pytest.raises(
            RecordingError, match="'Sample Interval' is '1e-06' in Hz; expected a step"
        ):
            open_recording(written(MSO58.replace("Units,s,s", "Units,Hz,Hz")))


class TestPicoScope:
    @pytest.mark.parametrize(
        ("unit", "rate"), [("s", 100.0), ("ms", 1e5), ("us", 1e8), ("µs", 1e8), ("ns", 1e11)]
    )
    @pytest.mark.parametrize("encoding", ["utf-8", "cp1252"])
    def test_the_line_of_units_is_obeyed(self, written, unit, rate, encoding):
        rows = PICO_ROWS.replace("-∞", "-2").replace("∞", "2")
        facts, samples = _read(written(PICO.format(rows).replace("(ms)", f"({unit})"), encoding))
        assert facts == {
            "Channel A": ("V", rate, -10 / rate),
            "Channel B": ("mV", rate, -10 / rate),
        }
        assert samples["Channel A"] == [4.825282, 2.0, -4.804224]

    def test_a_voltage_beyond_the_range_is_infinite_and_commas_come_with_semicolons(self, written):
        _, samples = _read(written(PICO.format(PICO_ROWS)))
        assert samples == {
            "Channel A": [4.825282, np.inf, -4.804224],
            "Channel B": [-15.9, -3.98, -np.inf],
        }
        german = "Zeit;Kanal A\n(ms);(V)\n\n0,00;1,5\n0,01;2,5\n".replace("Zeit", "Time")
        assert _read(written(german)) == ({"Kanal A": ("V", 1e5, 0.0)}, {"Kanal A": [1.5, 2.5]})


def test_a_sampling_period_above_single_values_is_the_rate(written):
    facts, samples = _read(written(GDS))
    assert facts == {"Waveform Data": ("V", 250e3, 0.0)}
    assert samples["Waveform Data"] == [1.0, 2.0, 3.0]
