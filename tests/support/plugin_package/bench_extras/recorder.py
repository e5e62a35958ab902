"""Text files of a recorder: `boxlog 1`, the rate in hertz, a name and a unit for each channel, the
number of samples, then a line for each sample."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

import numpy as np
from pyroshock.ingest.readers import ReadingOptions, RecordingError
from pyroshock.ingest.readers.contents import Contents, in_memory
from pyroshock.ingest.readers.recording import ArrayReader


class BoxlogReader(ArrayReader):
    """A channel is named and has its unit in the header; a file that is cut short is refused."""

    format = "boxlog"
    suffixes = (".boxlog",)

    def contents(self, path: Path, open_files: ExitStack, options: ReadingOptions) -> Contents:
        lines = path.read_text(encoding="utf-8").splitlines()
        if lines[:1] != ["boxlog 1"]:
            raise RecordingError(f"{path.name}: the first line is not 'boxlog 1'")
        start = lines.index("samples:")
        header = [line.split() for line in lines[1:start]]
        rate_hz = next(float(words[1]) for words in header if words[0] == "rate")
        channels = [(words[1], words[2]) for words in header if words[0] == "channel"]
        samples = next(int(words[1]) for words in header if words[0] == "length")
        table = np.array([line.split() for line in lines[start + 1 :]], dtype=np.float64)
        if table.shape != (samples, len(channels)):
            raise RecordingError(
                f"{path.name}: has {len(table)} lines of samples; expected {samples} of "
                f"{len(channels)} numbers"
            )
        columns = [
            in_memory(name, table[:, column], unit=unit)
            for column, (name, unit) in enumerate(channels)
        ]
        return Contents([in_memory("fs", np.array(rate_hz)), *columns])
