"""Files of a few kilobytes that declare ten gigabytes: refused, and in little memory."""

from __future__ import annotations

import re
import struct
import subprocess
import sys
import zipfile
import zlib

import h5py
import numpy as np
import pytest
from scipy.io import savemat

MANY = 1_250_000_000  # doubles: 10 GB
MOST_BYTES = 200e6
LENGTH = 0xFFFFFFF0  # 4 GB: Python and scipy make room for as much as a file asks for

#: Runs in its own process, so that the peak is of this one file. ru_maxrss is in KiB on Linux.
_OPEN = """
import resource, sys
from pathlib import Path
import h5py, nptdms, pyarrow.parquet, scipy.io  # the libraries' own weight is not the file's
from pyroshock.ingest.readers import RecordingError, open_recording
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
# Room that is asked for and not used up costs nothing but here.
resource.setrlimit(resource.RLIMIT_DATA, (before * 1024 + 2**30, resource.RLIM_INFINITY))
try:
    with open_recording(Path(sys.argv[1])) as recording:
        recording.read("force")
    print("read")
except RecordingError as refused:
    print("refused", refused)
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024)
"""


def npz(samples, zeros):
    """A member whose header declares so many samples, before so many zeros."""
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({samples},), }}"
    header = b"\x93NUMPY\x01\x00" + struct.pack("<H", 118) + text.ljust(117).encode() + b"\n"

    def write(path):
        np.savez(path, fs=51200.0)
        with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
            archive.writestr("force.npy", header + bytes(zeros))

    return write


def mat(old, new, compressed=False, **more):
    """1000 samples, and bytes of the file replaced."""

    def write(path):
        savemat(path, {"fs": 51200.0, "force": np.arange(1000.0), **more})
        content = path.read_bytes()
        assert old in content
        content = content.replace(old, new)
        if compressed:
            start = content.index(b"force") - 48  # tag, flags, dimensions and the tag of the name
            packed = zlib.compress(content[start:])
            content = content[:start] + struct.pack("<II", 15, len(packed)) + packed
        path.write_bytes(content)

    return write


def hdf5(**written):
    def write(path):
        declared = "force" if "fs" in written else "time"
        with h5py.File(path, "w") as file:
            file.update(written)
            file.create_dataset(declared, (MANY,), "f8", chunks=(1024,))

    return write


def parquet_of_one_value(path):
    """2e7 equal values, run-length encoded in a few hundred bytes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({"force": pa.array(np.zeros(20_000_000))}).replace_schema_metadata(
        {"fs": "51200"}
    )
    pq.write_table(table, path)


def tdms(old=b"", new=b"", parts=lambda: (), **properties):
    """One channel of 1000 samples, and bytes of the file replaced."""
    from nptdms import ChannelObject, TdmsWriter

    def write(path):
        with TdmsWriter(path) as writer:
            channel = ChannelObject(
                "shot", "force", np.arange(1000.0), {"wf_increment": 1 / 51200, **properties}
            )
            writer.write_segment([*parts(), channel])
        assert old in path.read_bytes()
        path.write_bytes(path.read_bytes().replace(old, new))

    return write


def scales():
    """The group's own number hides the file's."""
    from nptdms import GroupObject, RootObject

    return RootObject({"NI_Number_Of_Scales": 2**40}), GroupObject(
        "shot", {"NI_Number_Of_Scales": 1}
    )


SHAPES = struct.pack("<ii", 1, 1000), struct.pack("<ii", 1, MANY)
DECLARES = r"'(force|time)' declares \d{9,} bytes in a file of \d+"
SCALES = "NI_Number_Of_Scales is 1099511627776"
#: Name -> suffix, writer, and what the refusal says.
BOMBS = {
    "npz-declares": (".npz", npz(MANY, 64), DECLARES),
    # 300 MB of zeros in 300 kB: within what the header declares, and beyond 1000 times the file
    "npz-inflates": (".npz", npz(37_500_000, 300_000_000), DECLARES),
    "mat-declares": (".mat", mat(*SHAPES), DECLARES),
    "mat-compressed-declares": (".mat", mat(*SHAPES, compressed=True), DECLARES),
    # a count of 4 GB in the tag before dimensions of 1000 samples: scipy believes the tag
    "mat-false-count": (
        ".mat",
        mat(struct.pack("<II", 9, 8000), struct.pack("<II", 9, LENGTH)),
        "declares 1000 samples of 8 bytes and holds 4294967280",
    ),
    "hdf5-declares": (".h5", hdf5(fs=51200.0), DECLARES),
    "hdf5-time-declares": (".h5", hdf5(force=np.arange(100.0)), DECLARES),
    "parquet-one-value": (".parquet", parquet_of_one_value, DECLARES),
    "mat-long-name": (
        ".mat",
        mat(
            struct.pack("<II", 1, 12), struct.pack("<II", 1, LENGTH), acceleration=np.arange(1000.0)
        ),
        "declares 4294967280 bytes before its numbers",
    ),
    # UTF-8 has no fixed width, but none of 4 bytes a letter is that long
    "mat-long-text": (
        ".mat",
        mat(struct.pack("<II", 16, 9), struct.pack("<II", 16, LENGTH), operator="Anastasia"),
        "'operator' declares 9 samples of 1 bytes and holds 4294967280",
    ),
    # a property of twelve bytes, for which npTDMS makes a list of 2**40 entries
    "tdms-many-scales": (".tdms", tdms(NI_Number_Of_Scales=2**40), SCALES),
    "tdms-many-scales-in-the-file": (".tdms", tdms(parts=scales), SCALES),
    "tdms-long-text": (
        ".tdms",
        tdms(
            struct.pack("<I", 6) + b"newton",
            struct.pack("<I", LENGTH) + b"newton",
            unit_string="newton",
        ),
        "Error decoding string from bytes",
    ),
    "tdms-declares": (
        ".tdms",
        tdms(struct.pack("<IIQ", 10, 1, 1000), struct.pack("<IIQ", 10, 1, MANY)),
        "Data size 8000 is not a multiple of the chunk size",
    ),
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_bomb_is_refused_in_little_memory(bomb, tmp_path):
    suffix, write, reason = BOMBS[bomb]
    path = tmp_path / f"{bomb}{suffix}"
    write(path)
    assert path.stat().st_size < 1e6
    done = subprocess.run(
        [sys.executable, "-c", _OPEN, path], capture_output=True, text=True, timeout=60, check=True
    )
    outcome, peak_bytes = done.stdout.strip().splitlines()
    assert re.match(rf"refused {path.name}: .*{reason}", outcome), outcome
    assert float(peak_bytes) < MOST_BYTES
    assert done.stderr == ""
