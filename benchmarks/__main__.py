"""`python -m benchmarks [THEME…]`: measure and tell each figure as it comes; all themes make docs/benchmarks.md."""

from __future__ import annotations

import sys

from .figures import DOCUMENT, Figure, write
from .themes import THEMES, work_folder


def main(names: list[str]) -> int:
    unknown = sorted(set(names) - set(THEMES))
    if unknown:
        sys.stderr.write(f"unknown: {', '.join(unknown)}; known: {', '.join(THEMES)}\n")
        return 2
    figures: list[Figure] = []
    with work_folder() as folder:
        for name in names or THEMES:
            for figure in THEMES[name](folder):
                figures.append(figure)
                sys.stdout.write(figure.row() + "\n")
                sys.stdout.flush()
    if not names:
        write(figures)
        sys.stdout.write(f"written: {DOCUMENT}\n")
    return 0 if all(figure.holds for figure in figures if figure.binding) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
