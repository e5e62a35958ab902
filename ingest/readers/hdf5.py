"""HDF5: data sets at any depth, read by slices; also the inside of MATLAB 7.3 files.

Packed data sets are unpacked by the conventions of netCDF: value = stored * scale_factor +
add_offset, and NaN for _FillValue, missing_value and what lies outside of valid_range. A data set
with a dimension scale that is time has the scale's times.
"""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .base import ReadingOptions, RecordingError, refuse_bomb
from .contents import (
    RATE_NAMES,
    Array,
    Contents,
    in_memory,
    limited,
    seconds_for,
    time_scale,
    to_python,
)
from .hdf5_fields import HDF5_FIELDS
from .matlab_classes import matlab_obstacle, sparse_vector
from .packing import NetcdfPacking, packing_of
from .recording import ArrayReader

if TYPE_CHECKING:
    import h5py

_LONGEST_TEXT = 4096
#: What netCDF writes as the name of a dimension that has no values.
_NO_VARIABLE = "This is a netCDF dimension but not a netCDF variable"


class Hdf5Reader(ArrayReader):
    """`fs` is a data set, or an attribute of a data set or of any group above it; `unit` is an
    attribute."""

    format = "hdf5"
    suffixes = (".h5", ".hdf5", ".hdf")
    fields = HDF5_FIELDS

    def contents(self, path: Path, open_files: ExitStack, _: ReadingOptions) -> Contents:
        return hdf5_contents(path, open_files)


def hdf5_contents(path: Path, open_files: ExitStack) -> Contents:
    """Every data set of `path`. Links to other files are not followed; data kept in other files are
    refused."""
    import h5py

    with limited(seconds_for(path.stat().st_size)):
        return _contents(
            path, open_files.enter_context(h5py.File(path, "r", locking="best-effort"))
        )


def _contents(path: Path, file: h5py.File) -> Contents:
    import h5py

    datasets: list[h5py.Dataset] = []
    sparse: list[h5py.Group] = []
    statements: dict[str, dict[str, Any]] = {"": _attributes(file)}

    def collect(_: str, item: Any) -> None:
        if item.name.startswith("/#"):  # `#refs#`: MATLAB's cells
            return
        if isinstance(item, h5py.Dataset):
            datasets.append(item)
        elif "MATLAB_sparse" in item.attrs:
            sparse.append(item)
        else:
            statements[item.name.lstrip("/")] = _attributes(item)

    file.visititems(collect)
    inside = tuple(f"{group.name}/" for group in sparse)
    datasets = [dataset for dataset in datasets if not dataset.name.startswith(inside)]
    texts: dict[str, Any] = {}
    arrays = [sparse_vector(path, group) for group in sparse]
    scales: dict[str, Floats] = {}
    for dataset in datasets:
        text, (group, _, name) = _text(dataset), dataset.name.lstrip("/").rpartition("/")
        if text is not None:
            texts[name] = text
            statements.setdefault(group, {})[name] = text
        elif not str(to_python(dataset.attrs.get("NAME", ""))).startswith(_NO_VARIABLE):
            arrays.append(_array(path, dataset, scales))
    return Contents(
        arrays, header={**_attributes(file), **texts}, statements=statements, rules=HDF5_FIELDS
    )


def _array(path: Path, dataset: h5py.Dataset, scales: dict[str, Floats]) -> Array:
    group, _, name = dataset.name.lstrip("/").rpartition("/")
    if dataset.is_virtual or dataset.external:
        raise RecordingError(
            f"{path.name}: {name!r} keeps its samples in another file; expected them in this one"
        )
    obstacle = matlab_obstacle(dataset) or _type_obstacle(dataset)
    if dataset.shape is None or "MATLAB_empty" in dataset.attrs:
        return in_memory(name, np.empty(0), group=group, obstacle=obstacle)
    _refuse_other_size(path, dataset, name)
    own = _attributes(dataset)
    rate = next((own[key] for key in own if key.lower() in RATE_NAMES), None)
    dtype = _real_dtype(dataset)
    packing = packing_of(path, name, own, dtype) if obstacle is None else NetcdfPacking()
    times, axis = _times_of(path, dataset, scales) if obstacle is None else (None, None)
    unit = next((str(own[key]) for key in ("unit", "units") if key in own), None)
    return Array(
        name,
        dataset.shape,
        packing.dtype(dtype),
        packing.unpacked(_taker(path, dataset)),
        group=group,
        unit=None if unit is None else unit.partition(" since ")[0],
        rate_hz=_rate_above(dataset) if rate is None else rate,
        start_s=float(own.get("start_s", 0.0)),
        times_s=times,
        header={
            key: value for key, value in own.items() if not key.startswith(("MATLAB_", "H5PATH"))
        },
        fields=own,
        obstacle=obstacle or axis,
    )


def _type_obstacle(dataset: h5py.Dataset) -> str | None:
    """What the numbers of a data set are where they are no samples: names of an enumeration, bits
    of a field."""
    import h5py

    if h5py.check_enum_dtype(dataset.dtype) is not None and dataset.dtype.kind != "b":
        return "is an enumeration, whose numbers stand for words; expected samples"
    if dataset.id.get_type().get_class() == h5py.h5t.BITFIELD:
        return "is a bit field; expected samples"
    return None


def _times_of(
    path: Path, dataset: h5py.Dataset, scales: dict[str, Floats]
) -> tuple[Floats | None, str | None]:
    """Times in seconds by the dimension scale of the samples' axis, and why a scale is no time;
    None where there is no scale with values."""
    if (
        not dataset.shape
        or "DIMENSION_LIST" not in dataset.attrs
        or sum(length != 1 for length in dataset.shape) > 1
    ):
        return None, None
    for scale in dataset.dims[int(np.argmax(dataset.shape))].values():
        own = _attributes(scale)
        name = scale.name.rpartition("/")[2]
        if str(own.get("NAME", "")).startswith(_NO_VARIABLE) or scale.shape != dataset.shape:
            continue
        unit = next(
            (str(own[key]).partition(" since ")[0] for key in ("units", "unit") if key in own), None
        )
        seconds = time_scale(name, unit)
        if seconds is None:
            return (
                None,
                f"is over {name!r} in {unit!r}, which is no time; expected samples over time",
            )
        if scale.name not in scales:
            refuse_bomb(path, name, scale.size, 8)
            packing = packing_of(path, name, own, scale.dtype)
            values = packing.unpacked(_taker(path, scale))(0, scale.size)
            scales[scale.name] = np.asarray(values, dtype=np.float64) * seconds
        return scales[scale.name], None
    return None, None


def _refuse_other_size(path: Path, dataset: h5py.Dataset, name: str) -> None:
    """A data set in one piece has as many bytes as its shape needs, and one in pieces has all of
    them; libhdf5 reads another with zeros in places."""
    stored, needed = dataset.id.get_storage_size(), dataset.size * dataset.id.get_type().get_size()
    if dataset.chunks is not None and dataset.size:
        refuse_bomb(path, name, dataset.size, dataset.dtype.itemsize)
        chunks = int(
            np.prod(
                [
                    -(-length // chunk)
                    for length, chunk in zip(dataset.shape, dataset.chunks, strict=True)
                ]
            )
        )
        if dataset.id.get_num_chunks() < chunks:
            raise RecordingError(
                f"{path.name}: {name!r} was never written in "
                f"{chunks - dataset.id.get_num_chunks()} of its {chunks} "
                "pieces, which would be read as fill values; save the part that was recorded"
            )
    if dataset.chunks is None and stored != needed:
        raise RecordingError(
            f"{path.name}: {name!r} has {stored} bytes; its shape {dataset.shape} needs {needed}"
        )


def _taker(path: Path, dataset: h5py.Dataset) -> Any:
    """Slices along the one long axis, without reading the rest."""
    axis = int(np.argmax(dataset.shape)) if dataset.shape else 0
    size = path.stat().st_size

    def take(start: int, stop: int) -> NDArray[Any]:
        with limited(seconds_for(size, (stop - start) * dataset.dtype.itemsize)):
            if sum(length != 1 for length in dataset.shape) != 1:  # a scalar, or a matrix
                return np.asarray(dataset[()]).reshape(-1)[start:stop]
            where = tuple(slice(start, stop) if i == axis else 0 for i in range(dataset.ndim))
            return np.asarray(dataset[where])

    return take


def _real_dtype(dataset: h5py.Dataset) -> np.dtype[Any]:
    """The dtype, with complex numbers called so (MATLAB stores them as a pair of fields)."""
    fields = dataset.dtype.names or ()
    return np.dtype(complex) if {f.lower()[:2] for f in fields} == {"re", "im"} else dataset.dtype


def _rate_above(dataset: h5py.Dataset) -> Any:
    """The rate attribute of the nearest group above `dataset`; None where data sets `fs` or time
    say it instead."""
    group = dataset.parent
    while True:
        for key in group.attrs:
            if key.lower() in RATE_NAMES:
                return to_python(group.attrs[key])
        if group.name == "/" or any(key.lower() in RATE_NAMES for key in group):
            return None
        group = group.parent


def _attributes(item: Any) -> dict[str, Any]:
    import h5py

    values = {
        to_python(key): item.attrs[key] for key in item.attrs
    }  # a name that is no UTF-8 comes as bytes
    return {
        key: to_python(value)
        for key, value in values.items()
        if not isinstance(value, h5py.Empty | h5py.Reference)
    }


def _text(dataset: h5py.Dataset) -> str | None:
    """A short text: a scalar string, or MATLAB's char array of 16-bit codes."""
    import h5py

    if dataset.attrs.get("MATLAB_class") == b"char" and dataset.shape is not None:
        short = dataset.size <= _LONGEST_TEXT and dataset.dtype.kind == "u"
        return "".join(chr(code) for code in np.asarray(dataset[()]).reshape(-1)) if short else None
    if h5py.check_string_dtype(dataset.dtype) is None or dataset.shape is None or dataset.size != 1:
        return None
    return str(to_python(np.asarray(dataset[()]).reshape(-1)[0]))
