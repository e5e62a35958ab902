"""Campaign folders of this machine that may be ingested by their path: those below the folders that serve was given."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

FILE = "campaign.toml"
#: A tree of a million files is not walked through for a list of suggestions.
_DEPTH, _MOST = 3, 200


class PathError(ValueError):
    """A path is not one that may be read; nothing of it is told but what was given."""


def confined(path: str, roots: Sequence[Path]) -> Path:
    """The folder behind a path, links followed, if it lies below one of `roots` and holds a campaign.

    Raises `PathError` otherwise, in the same words whether or not there is something outside.
    """
    if not roots:
        raise PathError("no folder may be read: start with pyroshock serve --data FOLDER, or upload the campaign")
    if "\0" in path:
        raise PathError(f"{path!r} is no path")
    for root in (root_path.resolve() for root_path in roots):
        try:
            resolved = (root / path).resolve()  # a path that begins at the root of the disk stands for itself
        except (OSError, RuntimeError):
            continue
        if resolved.is_relative_to(root) and (resolved / FILE).is_file():
            return resolved
    root_names = ", ".join(str(root) for root in roots)
    raise PathError(f"{path!r} is no campaign folder (one with a {FILE}) below {root_names}")


def campaigns_below(roots: Sequence[Path]) -> list[str]:
    """Paths of campaign folders below `roots`, as `confined` takes them; the first 200."""
    campaigns = []
    for root in roots:
        for folder in _walked(root.resolve(), _DEPTH):
            campaigns.append(str(folder))
            if len(campaigns) == _MOST:
                return campaigns
    return campaigns


def _walked(folder: Path, depth: int) -> Iterator[Path]:
    try:
        if (folder / FILE).is_file():
            yield folder
            return
        below = (
            sorted(child for child in folder.iterdir() if child.is_dir() and not child.is_symlink()) if depth else []
        )
    except OSError:
        return
    for child in below:
        if not child.name.startswith("."):
            yield from _walked(child, depth - 1)
