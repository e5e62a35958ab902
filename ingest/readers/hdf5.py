"""HDF5: data sets at any depth, read by slices; also the inside of MATLAB 7.3 files."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .base import ReadingOptions, RecordingError
from .contents import RATE_NAMES, Array, Contents, in_memory, limited, seconds_for, to_python
from .recording import ArrayReader

if TYPE_CHECKING:
    import h5py

_LONGEST_TEXT = 4096


class Hdf5Reader(ArrayReader):
    """`fs` is a data set, or an attribute of a data set or of any group above it; `unit` is an attribute."""

    format = "hdf5"
    suffixes = (".h5", ".hdf5", ".hdf")

    def contents(self, path: Path, open_files: ExitStack, _: ReadingOptions) -> Contents:
        return hdf5_contents(path, open_files)


def hdf5_contents(path: Path, open_files: ExitStack) -> Contents:
    """Every data set of `path`. Links to other files are not followed; data kept in other files are refused."""
    import h5py

    with limited(seconds_for(path.stat().st_size)):
        return _contents(path, open_files.enter_context(h5py.File(path, "r", locking="best-effort")))


def _contents(path: Path, file: h5py.File) -> Contents:
    import h5py

    datasets: list[h5py.Dataset] = []

    def collect(_: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and not item.name.startswith("/#"):  # `#refs#`: MATLAB's cells
            datasets.append(item)

    file.visititems(collect)
    texts = {d.name.rpartition("/")[2]: text for d in datasets if (text := _text(d)) is not None}
    arrays = [_array(path, d) for d in datasets if _text(d) is None]
    return Contents(arrays, header={**_attributes(file), **texts})


def _array(path: Path, dataset: h5py.Dataset) -> Array:
    group, _, name = dataset.name.lstrip("/").rpartition("/")
    if dataset.is_virtual or dataset.external:
        raise RecordingError(f"{path.name}: {name!r} keeps its samples in another file; expected them in this one")
    if dataset.shape is None or "MATLAB_empty" in dataset.attrs:
        return in_memory(name, np.empty(0), group=group)
    _refuse_other_size(path, dataset, name)
    own = _attributes(dataset)
    rate = next((own[key] for key in own if key.lower() in RATE_NAMES), None)
    return Array(
        name,
        dataset.shape,
        _real_dtype(dataset),
        _taker(path, dataset),
        group=group,
        unit=next((str(own[key]) for key in ("unit", "units") if key in own), None),
        rate_hz=_rate_above(dataset) if rate is None else rate,
        start_s=float(own.get("start_s", 0.0)),
        header={key: value for key, value in own.items() if not key.startswith(("MATLAB_", "H5PATH"))},
    )


def _refuse_other_size(path: Path, dataset: h5py.Dataset, name: str) -> None:
    """A data set in one piece has as many bytes as its shape needs; libhdf5 reads another with zeros in places."""
    stored, needed = dataset.id.get_storage_size(), dataset.size * dataset.id.get_type().get_size()
    if dataset.chunks is None and stored != needed:
        raise RecordingError(f"{path.name}: {name!r} has {stored} bytes; its shape {dataset.shape} needs {needed}")


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
    """The rate attribute of the nearest group above `dataset`; None where data sets `fs` or time say it instead."""
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

    values = {to_python(key): item.attrs[key] for key in item.attrs}  # a name that is no UTF-8 comes as bytes
    return {
        key: to_python(value) for key, value in values.items() if not isinstance(value, h5py.Empty | h5py.Reference)
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
