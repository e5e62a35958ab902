"""Tiny recordings in every format that the readers know, written from readable recipes.

A new format is a function here and a line in `RECIPES`; the compliance suite does the rest.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from pyroshock.ingest.readers import AS_IN_FILE, ReadingOptions

RATE_HZ = 51200.0


@dataclass(frozen=True)
class Truth:
    """What a recipe wrote, and what the reader must give back."""

    channels: dict[str, np.ndarray]
    units: dict[str, str | None]
    rate_hz: float = RATE_HZ
    start_s: float = 0.0
    options: ReadingOptions = AS_IN_FILE  # what the file does not say

    @property
    def samples(self) -> int:
        return next(iter(self.channels.values())).size


@dataclass(frozen=True)
class Sample:
    path: Path
    truth: Truth


def base_truth() -> Truth:
    """Eighths, so that float32 and every decimal notation hold them exactly; one NaN per floating
    channel."""
    rng = np.random.default_rng(20261121)
    force = (rng.integers(-8000, 8000, 96) / 8).astype(np.float32)
    acceleration = rng.integers(-8000, 8000, 96) / 8
    force[5] = acceleration[17] = np.nan
    counts = rng.integers(-32768, 32767, 96).astype(np.int16)
    return Truth(
        {"force": force, "acceleration_1": acceleration, "counts": counts},
        {"force": "N", "acceleration_1": "m/s2", "counts": "V"},
    )


def unitless(truth: Truth) -> Truth:
    return replace(truth, units=dict.fromkeys(truth.units))


def all_double(truth: Truth) -> Truth:
    return replace(
        truth, channels={name: x.astype(np.float64) for name, x in truth.channels.items()}
    )


def times(truth: Truth) -> np.ndarray:
    return truth.start_s + np.arange(truth.samples) / truth.rate_hz


def write_mat5(path: Path, truth: Truth, compressed: bool = False) -> Truth:
    from scipy.io import savemat

    force, *others = truth.channels.items()
    shapes = {force[0]: force[1].reshape(-1, 1), **dict(others)}
    savemat(path, {"fs": truth.rate_hz, "operator": "Ana", **shapes}, do_compression=compressed)
    return unitless(truth)


def write_mat5_compressed(path: Path, truth: Truth) -> Truth:
    return write_mat5(path, truth, compressed=True)


def write_mat5_time(path: Path, truth: Truth) -> Truth:
    from scipy.io import savemat

    truth = replace(truth, start_s=-0.25)
    savemat(path, {"time": times(truth), **truth.channels}, oned_as="column")
    return unitless(truth)


def write_mat73(path: Path, truth: Truth) -> Truth:
    """As MATLAB does: HDF5 behind 512 bytes, every array a matrix with its class in an
    attribute."""
    import h5py

    classes = {"float32": b"single", "float64": b"double", "int16": b"int16"}
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in {"fs": np.array([truth.rate_hz]), **truth.channels}.items():
            data = file.create_dataset(name, data=values.reshape(-1, 1))
            data.attrs["MATLAB_class"] = np.bytes_(classes[values.dtype.name])
        text = file.create_dataset("operator", data=np.array([[65], [110], [97]], dtype=np.uint16))
        text.attrs["MATLAB_class"] = np.bytes_(b"char")
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")
    return unitless(truth)


def write_csv(path: Path, truth: Truth) -> Truth:
    truth = all_double(truth)
    with path.open("w", encoding="utf-8") as out:
        out.write(
            f"# fs = {truth.rate_hz}\n# samples = {truth.samples}\nforce "
            f"[N],acceleration_1 [m/s2],counts [V]\n"
        )
        out.writelines(
            ",".join(repr(float(v)) for v in row) + "\n"
            for row in zip(*truth.channels.values(), strict=True)
        )
    return truth


def write_csv_german(path: Path, truth: Truth) -> Truth:
    """Semicolons, decimal comma, byte-order mark, carriage returns, a line of units, time in
    milliseconds."""
    truth = replace(all_double(truth), start_s=0.125)
    with path.open("w", encoding="utf-8-sig", newline="\r\n") as out:
        out.write(
            f"Prüfer;Ana\nSamples;{truth.samples}\n\nTime;force;acceleration_1;counts\n"
            "ms;N;m/s2;V\n"
        )
        for time, *values in zip(times(truth), *truth.channels.values(), strict=True):
            out.write(
                ";".join([f"{time * 1e3:.6f}", *(repr(float(v)) for v in values)]).replace(".", ",")
                + "\n"
            )
    return truth


def write_text(path: Path, truth: Truth) -> Truth:
    """Blanks, two lines of heading below free text, Windows-1252."""
    truth = all_double(truth)
    lines = [f"Prüfstand 3, 24.11.2026\n% fs = {truth.rate_hz}\n% samples = {truth.samples}\n"]
    rows = [
        truth.channels,
        [truth.units[name] for name in truth.channels],
        *zip(*truth.channels.values(), strict=True),
    ]
    lines += ["".join(f"{value!s:>26}" for value in row) + " \n" for row in rows]
    path.write_text("".join(lines), encoding="cp1252")
    return truth


def write_text_bare(path: Path, truth: Truth) -> Truth:
    """Numbers below a comment, as numpy writes them: names and rate are the laboratory's to
    give."""
    truth = _given(unitless(all_double(truth)))
    np.savetxt(
        path,
        np.column_stack([*truth.channels.values()]),
        "%.17g",
        header=f"samples = {truth.samples}",
    )
    return truth


def write_npy(path: Path, truth: Truth) -> Truth:
    truth = _given(unitless(all_double(truth)))
    np.save(path, np.column_stack([*truth.channels.values()]))
    return truth


def write_wav(path: Path, truth: Truth) -> Truth:
    from scipy.io import wavfile

    truth = unitless(all_double(truth))
    truth = replace(truth, options=ReadingOptions(tuple(truth.channels)))
    wavfile.write(path, int(truth.rate_hz), np.column_stack([*truth.channels.values()]))
    return truth


def write_ide(path: Path, truth: Truth) -> Truth:
    """As a recorder does, with the maker's schema: settings, then a block of samples. Times are
    whole microseconds."""
    import ebmlite

    truth = replace(all_double(truth), rate_hz=50_000.0)
    truth = replace(truth, channels={name: np.nan_to_num(x) for name, x in truth.channels.items()})
    values = np.column_stack([*truth.channels.values()]).astype("<f4")
    as_stored = {"SubChannelCalibrationIDRef": 1, "SubChannelSensorRef": 20}
    parts = [
        {
            "SubChannelID": number,
            "SubChannelLabel": name,
            "SubChannelUnits": truth.units[name],
            **as_stored,
        }
        for number, name in enumerate(truth.channels)
    ]
    channel = {
        "ChannelID": 20, "ChannelName": "Bench", "ChannelCalibrationIDRef": 1,
        "ChannelFormat": "<" + "f" * len(parts), "TimeCodeScale": f"1.0/{truth.rate_hz:g}",
        "TimeCodeModulus": 2**24, "SubChannel": parts,
    }  # fmt: skip
    facts = {
        "RecorderInfo": {"RecorderSerial": 428, "ProductName": "Slam Stick C"},
        "SensorList": {"Sensor": {"SensorID": 20, "SensorName": "Load cell"}},
        "ChannelList": {"Channel": channel},
    }
    block = {
        "ChannelIDRef": 20,
        "StartTimeCodeAbsMod": 0,
        "EndTimeCodeAbsMod": truth.samples - 1,
        "ChannelDataPayload": values.tobytes(),
    }
    schema = ebmlite.loadSchema("mide_ide.xml")
    with path.open("wb") as file:
        schema.encode(file, {"EBML": {"DocType": "mide", "DocTypeVersion": 2}})
        polynomial = {"CalID": 1, "PolynomialCoef": [1.0, 0.0]}
        schema.encode(file, {"CalibrationList": {"UnivariatePolynomial": polynomial}})
        schema.encode(file, {"RecordingProperties": facts})
        schema.encode(file, {"ChannelDataBlock": block})
    return truth


def _given(truth: Truth) -> Truth:
    return replace(truth, options=ReadingOptions(tuple(truth.channels), truth.rate_hz))


def write_parquet(path: Path, truth: Truth) -> Truth:
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields = [
        pa.field(name, pa.from_numpy_dtype(x.dtype), metadata={"unit": truth.units[name]})
        for name, x in truth.channels.items()
    ]
    schema = pa.schema(fields, metadata={"fs": str(truth.rate_hz), "operator": "Ana"})
    pq.write_table(pa.table(list(truth.channels.values()), schema=schema), path, row_group_size=40)
    return truth


def write_parquet_frame(path: Path, truth: Truth) -> Truth:
    """From pandas, as most are written: NaN stored as null, time as a column, units in the
    names."""
    import pandas as pd

    truth = replace(truth, start_s=-0.25)
    named = {f"{name} [{truth.units[name]}]": x for name, x in truth.channels.items()}
    pd.DataFrame({"time": times(truth), **named}).to_parquet(path)
    return truth


def write_tdms(path: Path, truth: Truth, parts: int = 1) -> Truth:
    from nptdms import ChannelObject, TdmsWriter

    truth = replace(truth, start_s=-0.25)
    waveform = {"wf_increment": 1 / truth.rate_hz, "wf_start_offset": truth.start_s}
    with TdmsWriter(path) as writer:
        for part in range(parts):
            where = slice(part * truth.samples // parts, (part + 1) * truth.samples // parts)
            writer.write_segment(
                [
                    ChannelObject(
                        "shot", name, x[where], {**waveform, "unit_string": truth.units[name]}
                    )
                    for name, x in truth.channels.items()
                ]
            )
    return truth


def write_uff(path: Path, truth: Truth, binary: int = 0) -> Truth:
    import pyuff

    truth = replace(all_double(truth), start_s=0.25)
    # pyuff writes NaN as 0, and leaves the file of a binary set to the garbage collector.
    truth = replace(truth, channels={name: np.nan_to_num(x) for name, x in truth.channels.items()})
    file = pyuff.UFF(str(path))
    for number, (name, values) in enumerate(truth.channels.items()):
        head = {
            "type": 58,
            "binary": binary,
            "func_type": 1,
            "id1": name,
            "rsp_node": number,
            "rsp_dir": 3,
        }
        places = {
            "ref_node": 0,
            "ref_dir": 0,
            "abscissa_spacing": 1,
            "abscissa_spec_data_type": 17,
            "orddenom_spec_data_type": 0,
        }
        unit = {"ordinate_axis_units_lab": truth.units[name]}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)
            file.write_sets([{**head, **places, **unit, "x": times(truth), "data": values}], "add")
    return truth


def write_uff_binary(path: Path, truth: Truth) -> Truth:
    return write_uff(path, truth, binary=1)


def write_lvm(path: Path, truth: Truth, decimal: str = ".", x_columns: str = "No") -> Truth:
    truth = replace(all_double(truth), start_s=0.25)
    n, names = len(truth.channels), list(truth.channels)
    heads = {
        "Channels": [str(n)],
        "Samples": [str(truth.samples)] * n,
        "Y_Unit_Label": [str(truth.units[name]) for name in names],
        "X0": ["2.5000000000000000E-1"] * n,
        "Delta_X": [f"{1 / truth.rate_hz:.6E}"] * n,
    }
    lines = [
        "LabVIEW Measurement\t",
        "Writer_Version\t2",
        "Separator\tTab",
        f"Decimal_Separator\t{decimal}",
    ]
    lines += ["Multi_Headings\tYes", f"X_Columns\t{x_columns}", "***End_of_Header***\t", "\t"]
    lines += ["\t".join([key, *values, ""]).replace(".", decimal) for key, values in heads.items()]
    lines += ["***End_of_Header***\t\t\t", "\t".join(["X_Value", *names, "Comment"])]
    for time, *row in zip(times(truth), *truth.channels.values(), strict=True):
        first = f"{time:.6f}" if x_columns == "One" else ""
        lines.append(
            "\t".join([first, *(f"{v:.6f}" for v in row)])
            .replace(".", decimal)
            .replace("nan", "NaN")
        )
    path.write_text("\n".join(lines) + "\n", encoding="utf-8", newline="\r\n")
    return truth


def write_hdf5(path: Path, truth: Truth) -> Truth:
    import h5py

    with h5py.File(path, "w") as file:
        file["fs"] = truth.rate_hz
        for name, values in truth.channels.items():
            file[name] = values
            file[name].attrs["unit"] = truth.units[name]
    return truth


def write_hdf5_nested(path: Path, truth: Truth) -> Truth:
    import h5py

    truth = replace(truth, start_s=0.5)
    with h5py.File(path, "w") as file:
        file.attrs["operator"] = "Ana"
        for name, values in truth.channels.items():
            options = {"chunks": (1, 16), "compression": "gzip", "fletcher32": True}
            data = file.create_dataset(f"shot/bench/{name}", data=values.reshape(1, -1), **options)
            data.attrs.update(
                {"unit": truth.units[name], "sampling_rate_hz": truth.rate_hz, "start_s": 0.5}
            )
    return truth


def write_npz(path: Path, truth: Truth) -> Truth:
    np.savez(path, fs=truth.rate_hz, operator="Ana", **truth.channels)
    return unitless(truth)


def write_npz_compressed(path: Path, truth: Truth) -> Truth:
    truth = replace(truth, start_s=0.5)
    np.savez_compressed(path, t=times(truth), **truth.channels)
    return unitless(truth)


#: Name -> suffix and writer. The writer returns what its format can hold of the truth it was given.
def write_csv_clock(path: Path, truth: Truth) -> Truth:
    """Dates and times of day that pass midnight, exact to the last digit."""
    truth = all_double(truth)
    steps_ps = round(1e12 / truth.rate_hz)
    with path.open("w", encoding="utf-8") as out:
        out.write(
            f"# samples = {truth.samples}\nTimestamp;force [N];acceleration_1 [m/s2];counts [V]\n"
        )
        for i, row in enumerate(zip(*truth.channels.values(), strict=True)):
            second, fraction = divmod(86399 * 10**12 + 999 * 10**9 + i * steps_ps, 10**12)
            day, second = divmod(second, 86400)
            date = ("2026-02-28", "2026-03-01")[day]
            clock = (
                f"{second // 3600:02d}:{second // 60 % 60:02d}:{second % 60:02d}.{fraction:012d}"
            )
            out.write(";".join([f"{date}T{clock}Z", *(repr(float(value)) for value in row)]) + "\n")
    return truth


def write_csv_apart(path: Path, truth: Truth) -> Truth:
    """Thousands apart, as a spreadsheet in German writes them."""
    truth = all_double(truth)
    with path.open("w", encoding="utf-8") as out:
        out.write(
            f"samples;{truth.samples}\nfs;{truth.rate_hz:g}\nforce "
            f"[N];acceleration_1 [m/s2];counts [V]\n"
        )
        for row in zip(*truth.channels.values(), strict=True):
            cells = ["" if np.isnan(value) else f"{value:,.3f}" for value in row]
            out.write(";".join(cell.translate(str.maketrans(",.", ".,")) for cell in cells) + "\n")
    return truth


def write_csv_yokogawa(path: Path, truth: Truth) -> Truth:
    """ASCII with header of an oscilloscope: no time column, an empty one at both ends, start and
    rate above."""
    truth = replace(all_double(truth), start_s=-0.25)

    def line(key: str, *values: object) -> str:
        return (
            ",".join([f'"{key}"', *(f'"{v}"' if isinstance(v, str) else str(v) for v in values)])
            + "\n"
        )

    count = len(truth.channels)
    with path.open("w", encoding="utf-8") as out:
        out.write(
            line("Model Name", "DLM3000")
            + line("BlockNumber", 1)
            + line("TraceName", *truth.channels)
        )
        out.write(
            line("BlockSize", *[truth.samples] * count)
            + line("VUnit", *(truth.units[n] for n in truth.channels))
        )
        out.write(line("SampleRate", *[f"{truth.rate_hz:.6E}"] * count))
        out.write(line("HResolution", *[f"{1 / truth.rate_hz:.6E}"] * count))
        out.write(
            line("HOffset", *[f"{truth.start_s:.6E}"] * count)
            + line("HUnit", *["s"] * count)
            + "\n"
        )
        for row in zip(*truth.channels.values(), strict=True):
            out.write(
                ",".join(
                    ["", *("" if np.isnan(value) else repr(float(value)) for value in row), ""]
                )
                + "\n"
            )
    return truth


RECIPES: dict[str, tuple[str, Callable[[Path, Truth], Truth]]] = {
    "mat5": (".mat", write_mat5),
    "mat5-compressed": (".mat", write_mat5_compressed),
    "mat5-time": (".mat", write_mat5_time),
    "mat73": (".mat", write_mat73),
    "csv": (".csv", write_csv),
    "csv-german": (".csv", write_csv_german),
    "csv-clock": (".csv", write_csv_clock),
    "csv-thousands-apart": (".csv", write_csv_apart),
    "csv-yokogawa": (".csv", write_csv_yokogawa),
    "text": (".txt", write_text),
    "text-bare": (".dat", write_text_bare),
    "npy": (".npy", write_npy),
    "wav": (".wav", write_wav),
    "parquet": (".parquet", write_parquet),
    "parquet-frame": (".parquet", write_parquet_frame),
    "tdms": (".tdms", write_tdms),
    "uff-ascii": (".uff", write_uff),
    "uff-binary": (".uff", write_uff_binary),
    "lvm": (".lvm", write_lvm),
    "lvm-comma": (".lvm", lambda path, truth: write_lvm(path, truth, ",", "One")),
    "hdf5": (".h5", write_hdf5),
    "hdf5-nested": (".hdf5", write_hdf5_nested),
    "npz": (".npz", write_npz),
    "npz-compressed": (".npz", write_npz_compressed),
}
if find_spec("idelib") is not None:  # optional: pyroshock[ide]
    RECIPES["ide"] = (".ide", write_ide)
