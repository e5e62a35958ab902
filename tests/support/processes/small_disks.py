"""Disks that are full at once: a few megabytes of memory, mounted."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest


@dataclass(frozen=True)
class SmallDisk:
    """A file system of its own."""

    folder: Path

    def fill(self, leave_kb: int = 0) -> None:
        """Take what room there is."""
        with (self.folder / "filler").open("wb", buffering=0) as file:
            free = os.statvfs(self.folder)
            left = free.f_bavail * free.f_bsize - 1024 * leave_kb
            while left > 0:
                left -= file.write(b"\\0" * min(left, 1 << 20))

    def make_room(self) -> None:
        """As an administrator would."""
        _run("mount", "-o", "remount,size=256m", str(self.folder))
        (self.folder / "filler").unlink(missing_ok=True)


@contextmanager
def small_disk(folder: Path, size: str) -> Iterator[SmallDisk]:
    """One of this size ("4m") at `folder`; skips the test where mounting is not allowed."""
    folder.mkdir()
    try:
        _run("mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder))
    except (OSError, subprocess.CalledProcessError) as error:
        pytest.skip(f"no small disk can be mounted here: {error}")
    try:
        yield SmallDisk(folder)
    finally:
        _run("umount", "-l", str(folder))


def _run(*words: str) -> None:
    subprocess.run(words, check=True, capture_output=True, timeout=60)
