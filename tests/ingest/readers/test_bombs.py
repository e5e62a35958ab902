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


def npy_header(samples: int) -> bytes:
    text = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({samples},), }}"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", 118) + text.ljust(117).encode() + b"\n"


def npz_that_declares(path):
    np.savez(path, fs=51200.0)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("force.npy", npy_header(MANY) + bytes(64))


def npz_that_inflates(path):
    """300 MB of zeros in 300 kB: within what the header declares, and beyond 1000 times the file."""
    np.savez(path, fs=51200.0)
    with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        archive.writestr("force.npy", npy_header(37_500_000) + bytes(300_000_000))


def mat_that_declares(path, compressed=False):
    savemat(path, {"fs": 51200.0, "force": np.arange(1000.0)}, do_compression=False)
    content = path.read_bytes()
    shape = struct.pack("<ii", 1, 1000)
    content = content.replace(shape, struct.pack("<ii", 1, MANY))
    if compressed:
        start = content.index(b"force") - 48  # tag, flags, dimensions and the tag of the name
        packed = zlib.compress(content[start:])
        content = content[:start] + struct.pack("<II", 15, len(packed)) + packed
    path.write_bytes(content)


def mat_with_a_false_byte_count(path):
    """Dimensions of 1000 samples, and a count of 4 GB in the tag before them: scipy believes the tag."""
    savemat(path, {"fs": 51200.0, "force": np.arange(1000.0)})
    content = path.read_bytes()
    path.write_bytes(content.replace(struct.pack("<II", 9, 8000), struct.pack("<II", 9, 0xFFFFFFF0)))


def hdf5_that_declares(path):
    with h5py.File(path, "w") as file:
        file["fs"] = 51200.0
        file.create_dataset("force", (MANY,), "f8", chunks=(1024,))


def hdf5_whose_time_declares(path):
    with h5py.File(path, "w") as file:
        file["force"] = np.arange(100.0)
        file.create_dataset("time", (MANY,), "f8", chunks=(1024,))


def parquet_of_one_value(path):
    """2e7 equal values, run-length encoded in a few hundred bytes."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = pa.table({"force": pa.array(np.zeros(20_000_000))}).replace_schema_metadata({"fs": "51200"})
    pq.write_table(table, path)


def write_tdms(path, *parts, **properties):
    """One channel of 1000 samples."""
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        channel = ChannelObject("shot", "force", np.arange(1000.0), {"wf_increment": 1 / 51200, **properties})
        writer.write_segment([*parts, channel])
    return path.read_bytes()


def tdms_that_declares(path):
    """1000 samples whose index says ten thousand million bytes."""
    content = write_tdms(path)
    path.write_bytes(content.replace(struct.pack("<IIQ", 10, 1, 1000), struct.pack("<IIQ", 10, 1, MANY)))


def tdms_of_many_scales(path):
    """A property of twelve bytes, for which npTDMS makes a list of 2**40 entries."""
    write_tdms(path, NI_Number_Of_Scales=2**40)


def tdms_of_many_scales_in_the_file(path):
    """... where the group's own number hides the file's."""
    from nptdms import GroupObject, RootObject

    parts = [RootObject({"NI_Number_Of_Scales": 2**40}), GroupObject("shot", {"NI_Number_Of_Scales": 1})]
    write_tdms(path, *parts)


def tdms_of_a_long_text(path):
    """A unit of 4 GB: Python makes room for as much as a file is asked for."""
    content = write_tdms(path, unit_string="newton")
    path.write_bytes(content.replace(struct.pack("<I", 6) + b"newton", struct.pack("<I", 0xFFFFFFF0) + b"newton"))


def mat_of_a_long_name(path):
    """A name of 4 GB, which scipy makes room for before it reads."""
    savemat(path, {"fs": 51200.0, "acceleration": np.arange(1000.0)})
    content = path.read_bytes()
    path.write_bytes(content.replace(struct.pack("<II", 1, 12), struct.pack("<II", 1, 0xFFFFFFF0)))


def mat_of_a_long_text(path):
    """Three letters in 4 GB: UTF-8 has no fixed width, but none of 4 bytes a letter is that long."""
    savemat(path, {"fs": 51200.0, "force": np.arange(1000.0), "operator": "Anastasia"})
    content = path.read_bytes()
    path.write_bytes(content.replace(struct.pack("<II", 16, 9), struct.pack("<II", 16, 0xFFFFFFF0)))


DECLARES = r"'(force|time)' declares \d{9,} bytes in a file of \d+"
#: Name -> suffix, writer, and what the refusal says.
BOMBS = {
    "npz-declares": (".npz", npz_that_declares, DECLARES),
    "npz-inflates": (".npz", npz_that_inflates, DECLARES),
    "mat-declares": (".mat", mat_that_declares, DECLARES),
    "mat-compressed-declares": (".mat", lambda path: mat_that_declares(path, compressed=True), DECLARES),
    "mat-false-count": (".mat", mat_with_a_false_byte_count, "declares 1000 samples of 8 bytes and holds 4294967280"),
    "hdf5-declares": (".h5", hdf5_that_declares, DECLARES),
    "hdf5-time-declares": (".h5", hdf5_whose_time_declares, DECLARES),
    "parquet-one-value": (".parquet", parquet_of_one_value, DECLARES),
    "mat-long-name": (".mat", mat_of_a_long_name, "declares 4294967280 bytes before its numbers"),
    "mat-long-text": (".mat", mat_of_a_long_text, "'operator' declares 9 samples of 1 bytes and holds 4294967280"),
    "tdms-many-scales": (".tdms", tdms_of_many_scales, "NI_Number_Of_Scales is 1099511627776"),
    "tdms-many-scales-in-the-file": (".tdms", tdms_of_many_scales_in_the_file, "NI_Number_Of_Scales is 1099511627776"),
    "tdms-long-text": (".tdms", tdms_of_a_long_text, "Error decoding string from bytes"),
    "tdms-declares": (".tdms", tdms_that_declares, "Data size 8000 is not a multiple of the chunk size"),
}


@pytest.mark.parametrize("bomb", BOMBS)
def test_a_bomb_is_refused_in_little_memory(bomb, tmp_path):
    suffix, write, reason = BOMBS[bomb]
    path = tmp_path / f"{bomb}{suffix}"
    write(path)
    assert path.stat().st_size < 1e6
    done = subprocess.run([sys.executable, "-c", _OPEN, path], capture_output=True, text=True, timeout=60, check=True)
    outcome, peak_bytes = done.stdout.strip().splitlines()
    assert re.match(rf"refused {path.name}: .*{reason}", outcome), outcome
    assert float(peak_bytes) < MOST_BYTES
    assert done.stderr == ""
