"""The most memory that a piece of work took."""

from __future__ import annotations

from pathlib import Path

_STATUS, _RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


class PeakMemory:
    """Counts from its making on, where the operating system lets a process forget its peak (Linux); otherwise from the
    start of the process."""

    def __init__(self) -> None:
        try:
            _RESET.write_text("5", encoding="ascii")
        except OSError:  # another system, or not allowed: then the peak is that of the whole process
            return

    def used_mb(self) -> float:
        """Resident memory in MB at its highest."""
        try:
            rows = dict(line.split(":", 1) for line in _STATUS.read_text(encoding="ascii").splitlines() if ":" in line)
            return float(rows["VmHWM"].split()[0]) / 1000
        except (OSError, KeyError):
            return _of_process_mb()


def _of_process_mb() -> float:
    import sys

    if sys.platform == "win32":
        return float("nan")
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1e6 if sys.platform == "darwin" else 1e3)
