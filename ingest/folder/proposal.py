"""A first description of a campaign from what its recordings say. What they do not say stays empty:
nothing is guessed, and each value that is filled in says where it is from."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...signals.units import SI_UNITS, UnitError, to_si
from ..errors import enumerated
from .description import CampaignDescription, read_rows
from .description_fields import (
    BENCH,
    COLUMNS,
    FACTS,
    GUN,
    GUN_DIMENSIONS,
    HAMMER,
    KIND_IN_FILE,
    NEEDED_COLUMNS,
    PLATE,
    DescribedKey,
)
from .file_statements import FolderStatements, StatedChannel

#: Words of a channel's name -> its quantity, where the file states no unit.
_NAME_WORDS: tuple[tuple[str, str], ...] = (
    ("force", "force"),
    ("acceleration", "acceleration"),
    ("accelerometer", "acceleration"),
    ("acc", "acceleration"),
    ("pressure", "pressure"),
    ("velocity", "velocity"),
    ("displacement", "displacement"),
    ("laser", "displacement"),
    ("strain", "strain"),
    ("temperature", "temperature"),
)
_CHECK = "please check"


@dataclass(frozen=True)
class DescriptionProposal:
    """A description with the source of each value: name of the key ("channels.force.unit",
    "runs.run") -> where it is from. `kind` is that of the form: gun, hammer, plate, or "" where the
    files do not tell."""

    kind: str
    description: CampaignDescription
    sources: Mapping[str, str]

    def campaign_text(self) -> str:
        """campaign.toml with the source behind each value, and a comment for what is missing."""
        description = self.description
        remarks = {key.keys: self.sources.get(key.name, "") for key in (*FACTS, *BENCH)}
        remarks["campaign", "kind"] = self.sources.get("campaign.kind", "")
        channels: dict[tuple[str, ...], str] = {
            ("channels", channel, key): self.sources.get(f"channels.{channel}.{key}", "")
            for channel in description.value("channels") or {}
            for key in ("quantity", "unit", "position", "axis")
        }
        missing: dict[tuple[str, ...], str] = {
            key.keys: _missing_words(key)
            for key in (*FACTS, *BENCH)
            if (not self.kind or self.kind in key.kinds) and description.value(*key.keys) is None
        }
        if not self.kind:
            missing["campaign", "kind"] = "needed: gun or hammer"
        for channel, facts in (description.value("channels") or {}).items():
            missing |= {
                ("channels", channel, key): f"needed: {words}"
                for key, words in (
                    ("quantity", f"one of {', '.join(SI_UNITS)}"),
                    ("unit", "the recordings state no unit"),
                )
                if key not in facts
            }
        return description.campaign_text({**remarks, **channels}, missing)


def _missing_words(key: DescribedKey) -> str:
    unit = f"a number in {key.unit}. " if key.is_number and key.unit else ""
    return f"{'needed: ' if key.needed else ''}{unit}{key.why}"


def propose(
    folder: Path, statements: FolderStatements, name: str = "", kind: str = ""
) -> DescriptionProposal:
    """The description that the files of a folder give.

    Parameters:
        folder: The folder.
        statements: What its recordings say (`file_statements.read_statements`).
        name: What the folder is called; "" where nobody has named it.
        kind: The kind that a person stated: gun, hammer or plate; "" asks the recordings.

    Raises:
        IngestError: For a table of runs in the folder that cannot be read as one.
    """
    sources: dict[str, str] = {}
    channels = {
        channel.name: _channel(channel, sources, len(statements.readable))
        for channel in statements.channels
    }
    if not kind:
        kind, words = _kind(channels)
        if kind:
            sources["campaign.kind"] = f"{words}; {_CHECK}"
    campaign: dict[str, Any] = {}
    if name:
        campaign["name"], sources["campaign.name"] = name, f"the name of the folder; {_CHECK}"
    if kind:
        campaign["kind"] = KIND_IN_FILE[kind]
    if statements.days:
        campaign["date"], sources["campaign.date"] = _date(statements)
    if len(statements.operators) == 1:
        campaign["operator"] = statements.operators[0]
        sources["campaign.operator"] = "the recordings' own field"
    tables: dict[str, Any] = {"campaign": campaign}
    if len(statements.modal_tables) == 1:
        tables["bench"] = {"plate": {"modes": statements.modal_tables[0]}}
        sources["bench.plate.modes"] = f"{statements.modal_tables[0]} is among the files"
    tables["channels"] = channels
    columns, rows = read_rows(folder)
    if columns:
        sources["runs"] = str(statements.runs_table)
    else:
        columns, rows = _rows(statements, kind, sources)
    return DescriptionProposal(kind, CampaignDescription(tables, columns, rows), sources)


def _date(statements: FolderStatements) -> tuple[str, str]:
    days, files = statements.days, len(statements.readable)
    first, last = min(days), max(days)
    words = f"the headers of {sum(days.values())} of {files} recordings"
    return first, words if first == last else f"{words}, the first of {first} to {last}; {_CHECK}"


def _kind(channels: Mapping[str, Mapping[str, Any]]) -> tuple[str, str]:
    """The kind that the channels tell, and why."""
    quantities = {channel.get("quantity") for channel in channels.values()}
    if "pressure" in quantities:
        return GUN, "a pressure is recorded, as of a gun's tank"
    if "force" in quantities:
        return HAMMER, "a force is recorded, and no pressure of a tank"
    if quantities == {"acceleration"}:
        return PLATE, "accelerations alone are recorded"
    return "", ""


def _channel(channel: StatedChannel, sources: dict[str, str], files: int) -> dict[str, Any]:
    facts: dict[str, Any] = {}
    where = f"channels.{channel.name}"
    counted = f"{channel.files} of {files} recordings"
    if len(channel.units) > 1:
        sources[f"{where}.unit"] = f"the recordings state {enumerated(channel.units)}"
    unit = channel.units[0] if len(channel.units) == 1 else None
    quantity = _quantity_of_unit(unit)
    if quantity == "voltage":  # of a sensor, perhaps: the name tells of what, or nobody does
        named = _quantity_of_name(channel.name)
        if named is None:
            sources[f"{where}.quantity"] = "the recordings hold volts"
            return facts
        facts["quantity"] = named
        sources[f"{where}.quantity"] = f"the channel's name; {_CHECK}"
        sources[f"{where}.unit"] = "the recordings hold volts: state unit and sensitivity"
    elif quantity is not None:
        facts |= {"quantity": quantity, "unit": unit}
        sources[f"{where}.quantity"] = f"the unit in {counted}"
        sources[f"{where}.unit"] = counted
    else:
        if unit is not None:
            sources[f"{where}.unit"] = f"the recordings state {unit!r}, which is no known unit"
        named = _quantity_of_name(channel.name)
        if named is not None:
            facts["quantity"] = named
            sources[f"{where}.quantity"] = f"the channel's name; {_CHECK}"
    for key in ("position", "axis"):
        text = next((t for k, t in channel.hints.items() if k.strip().lower() == key), None)
        if text:
            facts[key], sources[f"{where}.{key}"] = text, "the recordings' own field"
    return facts


def _quantity_of_unit(unit: str | None) -> str | None:
    return next((quantity for quantity in SI_UNITS if _is_unit(unit, quantity)), None)


def _is_unit(unit: str | None, quantity: str) -> bool:
    try:
        return bool(unit) and bool(to_si(str(unit), quantity))
    except UnitError:  # a unit of another quantity, or none: the form asks for it
        return False


def _quantity_of_name(name: str) -> str | None:
    words = re.split(r"[^a-z]+", name.lower())
    return next((quantity for word, quantity in _NAME_WORDS if word in words), None)


def _rows(
    statements: FolderStatements, kind: str, sources: dict[str, str]
) -> tuple[tuple[str, ...], tuple[Mapping[str, str], ...]]:
    """A row for each readable recording, numbered by the names of the files where these tell it."""
    paths = [file.path for file in statements.readable]
    numbers = _numbers_of_names(paths)
    sources["runs.run"] = sources["runs.repetition"] = (
        f"the names of the files; {_CHECK}" if numbers else f"the order of the files; {_CHECK}"
    )
    sources["runs.recording"] = "the files"
    hits = numbers or [(place, 1) for place in range(1, len(paths) + 1)]
    further = COLUMNS[kind or HAMMER]
    columns = ("run", "repetition", *further, "recording")
    rows = tuple(
        {
            **dict.fromkeys(further, ""),
            "run": str(run),
            "repetition": str(repetition),
            "recording": path,
        }
        for (run, repetition), path in zip(hits, paths, strict=True)
    )
    return columns, rows


_Numbers = Callable[[str], tuple[int, int] | None]


def _run_and_repetition(stem: str) -> tuple[int, int] | None:
    """The last two numbers of a name, such as 7 and 2 of "0007-02"."""
    numbers = re.findall(r"\d+", stem)
    return (int(numbers[-2]), int(numbers[-1])) if len(numbers) >= 2 else None


def _run_alone(stem: str) -> tuple[int, int] | None:
    """The only number of a name."""
    numbers = re.findall(r"\d+", stem)
    return (int(numbers[0]), 1) if len(numbers) == 1 else None


def _numbers_of_names(paths: Sequence[str]) -> list[tuple[int, int]] | None:
    """Run and repetition of each file, where one pattern gives all of them, and no two the same."""
    patterns: tuple[_Numbers, ...] = (_run_and_repetition, _run_alone)
    for pattern in patterns:
        numbers = [pattern(Path(path).stem) for path in paths]
        hits = [hit for hit in numbers if hit is not None]
        small = all(0 <= run < 100_000 and 1 <= number <= 1000 for run, number in hits)
        if len(hits) == len(paths) == len(set(hits)) and small:
            return hits
    return None


def needed_columns(kind: str) -> tuple[str, ...]:
    """Columns of the table of runs without which the ingest refuses a row of this kind.

    Parameters:
        kind: Gun, hammer or plate; "" asks for none.
    """
    return NEEDED_COLUMNS.get(kind, ())


def lacks_gun_dimensions(description: CampaignDescription) -> list[tuple[str, ...]]:
    """The gun's dimensions that are missing beside others that are stated; none where all or none
    are stated.

    Parameters:
        description: What is stated.
    """
    absent = [keys for keys in GUN_DIMENSIONS if description.value(*keys) is None]
    return absent if 0 < len(absent) < len(GUN_DIMENSIONS) else []
