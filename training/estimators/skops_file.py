"""A fitted scikit-learn regressor as an array of bytes, in the format of skops: read back without pickle.

skops reads types by name and refuses those that it was not told to trust, before anything is made of them. It trusts
scikit-learn's estimators; what else a family needs, the family says (`PipelineRegression.trusted`).
"""

from __future__ import annotations

import io
import json
from collections.abc import Sequence
from typing import Any
from zipfile import BadZipFile, ZipFile, ZipInfo

import numpy as np
from numpy.typing import NDArray


class RegressorFileError(ValueError):
    """The bytes hold no regressor that may be read."""


def regressor_bytes(regressor: Any) -> NDArray[np.uint8]:
    """The bytes (k,) of a fitted regressor: the same for the same regressor, whenever and wherever."""
    import skops.io

    return np.frombuffer(_canonical(skops.io.dumps(regressor)), dtype=np.uint8)


def regressor_from(content: NDArray[np.uint8], trusted: Sequence[str]) -> Any:
    """The regressor of what `regressor_bytes` gave; `trusted` are names of types beyond those that skops trusts.

    Raises `RegressorFileError`, with the names of the types that are not trusted.
    """
    import skops.io
    from skops.io.exceptions import UntrustedTypesFoundException

    try:
        return skops.io.loads(content.tobytes(), trusted=trusted)
    except UntrustedTypesFoundException as error:
        raise RegressorFileError(f"refused before anything was made of it: {str(error).splitlines()[0]}") from error
    except (BadZipFile, EOFError, ImportError, LookupError, TypeError, ValueError, AttributeError) as error:
        raise RegressorFileError(f"no regressor can be read: {type(error).__name__}: {error}") from error


def _canonical(content: bytes) -> bytes:
    """Without what differs from run to run: addresses of objects, the time of writing, the gaps in a tree's nodes.

    Equal arrays stand once, whether or not they are one object.
    """
    names: dict[bytes, str] = {}

    def cleaned(node: Any) -> Any:
        if isinstance(node, list):
            return [cleaned(value) for value in node]
        if not isinstance(node, dict):
            return node
        if isinstance(node.get("file"), str):
            node["file"] = names.setdefault(_zero_gaps(source.read(node["file"])), f"{len(names)}.npy")
        return {name: cleaned(value) for name, value in node.items() if name != "__id__"}

    target = io.BytesIO()
    with ZipFile(io.BytesIO(content)) as source, ZipFile(target, "w") as file:
        schema = cleaned(json.loads(source.read("schema.json")))
        for array, name in names.items():
            file.writestr(ZipInfo(name), array)
        file.writestr(ZipInfo("schema.json"), json.dumps(schema))
    return target.getvalue()


def _zero_gaps(content: bytes) -> bytes:
    """An npy file whose bytes between the fields of a record are 0, not what lay in memory."""
    array = np.load(io.BytesIO(content), allow_pickle=False)
    if array.dtype.names is None:
        return content
    records = np.zeros(array.shape, array.dtype)
    for name in array.dtype.names:
        records[name] = array[name]
    file = io.BytesIO()
    np.save(file, records, allow_pickle=False)
    return file.getvalue()
