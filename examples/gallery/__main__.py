"""`python -m examples.gallery [NAME...] --out FOLDER`: figures of the thesis for
docs/measurements/gallery.md."""

from __future__ import annotations

import argparse
import logging
import sys
from collections.abc import Sequence
from pathlib import Path

from pyroshock.training.models.catalogue import models_of

from .figures import FIGURES, Scene
from .picture import write
from .trained import QUICK

RESULTS = Path("results") / "gallery"


def main(arguments: Sequence[str] | None = None) -> int:
    given = _parsed(arguments)
    unknown = [name for name in given.names if name not in FIGURES]
    if unknown:
        sys.stderr.write(f"no figure {unknown[0]!r}; there are: {', '.join(FIGURES)}\n")
        return 2
    try:
        models = tuple(models_of(given.models))
    except (LookupError, ValueError) as error:
        sys.stderr.write(f"{error.args[0]}\n")
        return 2
    logging.basicConfig(level=logging.WARNING, format="%(message)s")
    logging.getLogger(__package__).setLevel(logging.INFO)
    scene = Scene(given.work, given.hits, models)
    for name in given.names or FIGURES:
        write(FIGURES[name].draw(scene), given.out / f"{name}.png")
        sys.stdout.write(f"Fig. {FIGURES[name].thesis}: {given.out / f'{name}.png'}\n")
    return 0


def _parsed(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m examples.gallery", description=__doc__)
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"of {', '.join(FIGURES)}; none: all of them"
    )
    parser.add_argument(
        "--out", type=Path, default=RESULTS, help="folder of the pictures (%(default)s)"
    )
    parser.add_argument(
        "--work", type=Path, default=RESULTS, help="keeps the virtual campaign (%(default)s)"
    )
    parser.add_argument(
        "--hits",
        type=int,
        default=5,
        help="of each of its 180 tests; the thesis has 10 (%(default)s)",
    )
    parser.add_argument(
        "--models", default=",".join(QUICK), help="to train: a comma list, or all (%(default)s)"
    )
    return parser.parse_args(arguments)


if __name__ == "__main__" and (code := main()):
    sys.exit(code)
