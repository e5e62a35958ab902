"""What no commit may hold: files too large for every clone to carry, and lines that a merge left.
FILE... as words."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

#: The shipped record of a hammer is nearly as large.
LARGEST_BYTES = 1_000_000
_LEFT = re.compile(rb"^(<{7} |>{7} |={7}$)", re.MULTILINE)


def objections(path: Path) -> Iterator[str]:
    """A line for each thing that is wrong with a file."""
    size = path.stat().st_size
    if size > LARGEST_BYTES:
        yield (
            f"{path}: {size} bytes; at most {LARGEST_BYTES} go into the "
            f"repository: make it where it is needed"
        )
        return
    content = path.read_bytes()
    if found := _LEFT.search(content):
        line = content.count(b"\n", 0, found.start()) + 1
        yield f"{path}: line {line}: what a merge left"


def main(words: list[str]) -> int:
    wrong = [line for word in words if Path(word).is_file() for line in objections(Path(word))]
    print(*wrong, sep="\n", file=sys.stderr, end="\n" if wrong else "")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
