"""Files that the formats' own writers make of arrays that no recorder writes: odd shapes, types,
names, rates."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Mapping
from random import Random
from typing import Any

import numpy as np
from fuzzing.mutations.tables import NASTY
from numpy.typing import NDArray

Arrays = Mapping[str, NDArray[Any]]

_NAMES = (
    *(
        "force",
        "force",
        "acceleration_1",
        "force [N]",
        "fs",
        "FS",
        "fs_hz",
        "sampling_rate",
        "t",
        "time",
        "time_ms",
    ),
    *(
        "t_us",
        "x" * 63,
        "é",
        "a b",
        "_x",
        "",
        "samples",
        "N",
        "force\n",
        "x\x00y",
        "1",
        "/",
        ".",
        "a/b",
    ),
)
_TYPES = (
    "f8",
    "f4",
    "f2",
    "i1",
    "u1",
    "i2",
    ">i2",
    "i4",
    "u8",
    "i8",
    ">f8",
    "?",
    "c16",
    "S4",
    "U3",
    "M8[s]",
    "f16",
)
_SHAPES = ((), (1,), (0,), (2,), (96,), (1, 96), (96, 1), (8, 12), (1, 1, 96), (0, 5), (300,))
_RATES = (
    51200.0,
    51200,
    0.0,
    -1.0,
    1e-300,
    5e-324,
    1e308,
    float("nan"),
    float("inf"),
    1e-9,
    2**62,
    True,
    1 + 2j,
)


def arrays(rng: Random) -> dict[str, NDArray[Any]]:
    """A few arrays, among them more often than not a rate or a time."""
    found = {rng.choice(_NAMES): _array(rng) for _n in range(rng.randint(1, 5))}
    if rng.random() < 0.7:
        found["fs"] = np.asarray(rng.choice(_RATES))
    if rng.random() < 0.3:
        found["time"] = _times(rng)
    return found


def _array(rng: Random) -> NDArray[Any]:
    shape = rng.choice(_SHAPES)
    values = (
        np.random.default_rng(rng.randrange(2**32)).integers(-100, 100, shape).astype(np.float64)
    )
    if values.size and rng.random() < 0.4:
        values.reshape(-1)[rng.randrange(values.size)] = rng.choice(
            (np.nan, np.inf, -np.inf, 1e308, 5e-324)
        )
    with np.errstate(all="ignore"):
        return values.astype(rng.choice(_TYPES))


def _times(rng: Random) -> NDArray[np.float64]:
    times = np.arange(rng.choice((96, 96, 2, 1, 300))) * rng.choice(
        (1e-5, 1.0, 1e-300, 1e300, 0.0, -1.0)
    )
    if rng.random() < 0.5:
        times[rng.randrange(times.size)] = rng.choice((np.nan, np.inf, 0.0, -1.0, 1e308))
    return np.asarray(times + rng.choice((0.0, 0.0, -1e9, 1e300)))


def npz(found: Arrays, rng: Random) -> bytes:
    out = io.BytesIO()
    rng.choice((np.savez, np.savez_compressed))(out, allow_pickle=True, **found)
    return out.getvalue()


def npy(found: Arrays, rng: Random) -> bytes:
    """One of them, in either order, or all as the fields of rows."""
    out = io.BytesIO()
    chosen = rng.choice([*found.values()])
    if rng.random() < 0.3:
        rows = np.zeros(
            rng.choice((0, 1, 96)), [(name or "f0", values.dtype) for name, values in found.items()]
        )
        chosen = rows
    np.save(out, np.asfortranarray(chosen) if rng.random() < 0.5 else chosen, allow_pickle=True)
    return out.getvalue()


def wav(found: Arrays, rng: Random) -> bytes:
    from scipy.io import wavfile

    out = io.BytesIO()
    channels = rng.choice((1, 2, 3, 3, 3, 40))
    values = np.random.default_rng(rng.randrange(2**32)).integers(
        0, 100, (rng.choice((0, 1, 96)), channels)
    )
    wavfile.write(
        out,
        rng.choice((1, 51200, 2**32 - 1)),
        values.astype(rng.choice(("u1", "i2", "i4", "f4", "f8"))),
    )
    return out.getvalue()


def mat(found: Arrays, rng: Random) -> bytes:
    from scipy.io import savemat

    out = io.BytesIO()
    savemat(
        out, dict(found), do_compression=rng.random() < 0.5, oned_as=rng.choice(("row", "column"))
    )
    return out.getvalue()


def hdf5(found: Arrays, rng: Random) -> bytes:
    """With groups, attributes of any kind, chunks and filters."""
    import h5py

    out = io.BytesIO()
    with h5py.File(out, "w", libver=rng.choice(("earliest", "latest"))) as file:
        for name, values in found.items():
            place = rng.choice(("", "", "a/", "a/b/c/d/"))
            packed = (
                {"compression": "gzip", "shuffle": True}
                if values.size > 1 and rng.random() < 0.3
                else {}
            )
            data = file.create_dataset(place + name, data=values, **packed)
            for item in (data, file):
                if rng.random() < 0.5:
                    item.attrs[
                        rng.choice(("fs", "unit", "start_s", "x", "MATLAB_class", "MATLAB_empty"))
                    ] = _value(rng)
        if rng.random() < 0.2:
            file["loop"] = rng.choice(
                (h5py.SoftLink("/"), h5py.SoftLink("/loop"), h5py.ExternalLink("x.h5", "/"))
            )
    return out.getvalue()


def parquet(found: Arrays, rng: Random) -> bytes:
    """Columns of one length, with null, texts, lists and dictionaries among them."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows = rng.choice((0, 1, 96, 96))
    columns = {
        name: pa.array(np.resize(values.reshape(-1), rows)) for name, values in found.items()
    }
    kinds = ([None, 1.0], ["a", None], [[1.0], []], [{"a": 1}, None], [b"x", b"y"], [True, None])
    odd = rng.choice(kinds) * (rows // 2) + [None] * (rows % 2)
    columns[rng.choice(_NAMES)] = (
        pa.array(odd).dictionary_encode() if rng.random() < 0.2 else pa.array(odd)
    )
    metadata = (
        {"fs": str(_value(rng)), rng.choice(NASTY): rng.choice(NASTY)}
        if rng.random() < 0.8
        else None
    )
    out = io.BytesIO()
    table = pa.table(columns).replace_schema_metadata(metadata)
    pq.write_table(
        table,
        out,
        compression=rng.choice(("snappy", "zstd", "none")),
        row_group_size=rng.choice((7, 96)),
    )
    return out.getvalue()


def tdms(found: Arrays, rng: Random) -> bytes:
    from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

    out = io.BytesIO()
    keys = (
        "wf_increment",
        "wf_start_offset",
        "unit_string",
        "fs",
        "NI_Scale[0]_Scale_Type",
        "NI_Number_Of_Scales",
    )

    def properties() -> dict[str, Any]:
        return {rng.choice(keys): _value(rng) for _n in range(rng.randint(0, 3))}

    with TdmsWriter(out) as writer:
        for _n in range(rng.choice((1, 1, 2, 3))):
            channels = [
                ChannelObject("shot", n, np.atleast_1d(v).reshape(-1), properties())
                for n, v in found.items()
            ]
            writer.write_segment(
                [RootObject(properties()), GroupObject("shot", properties()), *channels]
            )
    return out.getvalue()


def _value(rng: Random) -> Any:
    """Of an attribute or a property."""
    texts = [text for text in NASTY if "\x00" not in text and len(text) < 5000]
    values = (*_RATES[:-1], 1 / 51200, "N", rng.choice(texts), 7, -3, np.float32(0.1), np.int16(-5))
    return rng.choice(values)


def any_file(write: Callable[[Arrays, Random], bytes]) -> Callable[[bytes, Random, Any], bytes]:
    """As a mutation: a file that has nothing of the one before. What its format cannot hold is
    tried anew."""

    def mutate(data: bytes, rng: Random, _: Any) -> bytes:
        for _n in range(5):
            try:
                with np.errstate(all="ignore"), warnings.catch_warnings():
                    warnings.simplefilter("ignore")
                    return write(arrays(rng), rng)
            except Exception:  # noqa: BLE001, S112
                # Each writer has its own words for what its format cannot hold.
                continue
        return data

    return mutate
