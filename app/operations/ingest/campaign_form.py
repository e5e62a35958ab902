"""The form of a campaign: its description as the texts of controls, and the texts of a form as a
description.

Controls are called as the keys of campaign.toml are (`bench.plate.thickness_m`); those of channels
and runs have the place of their row in the name (`channels.0.unit`, `run.3.5`). What is typed is
not judged here: a text that is no number stays a text, which the ingest refuses with its own words.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from ....ingest.folder.column_names import KEYS, KNOWN
from ....ingest.folder.description import CampaignDescription
from ....ingest.folder.description_fields import (
    BENCH,
    COLUMNS,
    FACTS,
    HAMMER,
    KIND_IN_FILE,
    NEEDED_COLUMNS,
    NOT_USED,
    PLATE,
    READING,
    ROLES,
    DescribedKey,
)
from ....ingest.folder.typed_values import number_of, outline_of, plain_text
from ....schema.campaigns import UNKNOWN_DATE
from ....signals.channel import on_impactor

Texts = Mapping[str, Sequence[str]]
RECORDING = "recording"
#: Keys of a channel beside its name and its role.
CHANNEL_KEYS = ("unit", "sensitivity", "offset_v", "position", "axis", "range")
_CHANNEL_NUMBERS = ("sensitivity", "offset_v", "range")
#: Keys whose value is a list of texts, a line each in the form.
_LISTS = (("recordings", "columns"), ("recordings", "harmless_fields"))
_IMPACTOR, _MUZZLE = "impactor", "muzzle"


@dataclass(frozen=True)
class FormChannel:
    """A channel of the form: its name, its role, and the texts of its other controls by key."""

    name: str
    role: str
    texts: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class FormTexts:
    """The texts of a form. `facts` by the names of keys; `shared` are cells that all rows have, by
    column, and `rows` the cells of each row, empty where the shared one holds; `unused` are paths
    of recordings that no row names; `free_factors` what a column of the laboratory's own is."""

    kind: str
    facts: Mapping[str, str]
    channels: Sequence[FormChannel]
    columns: Sequence[str]
    shared: Mapping[str, str]
    rows: Sequence[Mapping[str, str]]
    unused: Sequence[str] = ()
    free_factors: Mapping[str, str] = field(default_factory=dict)
    confirmed: Sequence[str] = ()
    force_from: Sequence[str] = ()
    #: Of each row its place on the page, which has rows that are not used, too.
    places: Sequence[int] = ()


def kind_of(description: CampaignDescription) -> str:
    """The kind of form that shows a description: gun, hammer or plate.

    Parameters:
        description: The description; one without a kind has that of a hammer or a plate by what it
            states of the hammer.
    """
    if description.value("campaign", "kind") not in ("hammer", None):
        return str(description.value("campaign", "kind"))
    hammer = description.value("bench", "hammer") or "hammer_speed" in description.columns
    return HAMMER if hammer else PLATE


def texts_of(
    kind: str,
    description: CampaignDescription,
    recorded: Sequence[str] = (),
    recordings: Sequence[str] = (),
) -> FormTexts:
    """A description as the texts of the form.

    Parameters:
        kind: Gun, hammer or plate; "" where it is not known.
        description: The description.
        recorded: Names of all channels that the recordings have: those that the description lacks
            are shown as not used.
        recordings: Paths of all recordings: those that no row names are shown as not used.
    """
    facts = {
        key.name: _text(key, description.value(*key.keys)) for key in (*FACTS, *BENCH, *READING)
    }
    if facts["campaign.date"] == UNKNOWN_DATE.isoformat():
        facts |= {"campaign.date": "", "campaign.date_unknown": "1"}
    force = description.value("force") or {}
    facts |= {f"force.{key}": str(value) for key, value in force.items() if key != "from"}
    channels = description.value("channels") or {}
    names = dict.fromkeys([*recorded, *channels])
    columns = [column for column in description.columns if column != RECORDING]
    usual = [c for own in COLUMNS.values() for c in own if c not in columns]
    shared, rows = _cells(description, [*columns, *usual])
    named = {part for row in description.rows for part in row.get(RECORDING, "").split(";")}
    return FormTexts(
        kind,
        facts,
        [_channel(name, channels.get(name)) for name in names],
        [*columns, *usual],
        shared,
        rows,
        [path for path in recordings if path not in named],
        {k: str(v) for k, v in (description.value("factors") or {}).items()},
        tuple(description.value("bench", "confirmed") or ()),
        tuple(force.get("from", ())),
    )


def _cells(
    description: CampaignDescription, columns: Sequence[str]
) -> tuple[dict[str, str], list[dict[str, str]]]:
    """Cells that all rows have in common, and those of each row."""
    rows = description.rows
    shared = {}
    for column in columns:
        cells = {row.get(column, "") for row in rows}
        if column not in KEYS and len(rows) > 1 and len(cells) == 1:
            shared[column] = next(iter(cells))
    own = [
        {c: "" if c in shared else row.get(c, "") for c in columns}
        | {RECORDING: row.get(RECORDING, "")}
        for row in rows
    ]
    return shared, own


def _channel(name: str, facts: Mapping[str, Any] | None) -> FormChannel:
    if facts is None:  # a description names every channel that is used, also one without facts
        return FormChannel(name, NOT_USED)
    position = str(facts.get("position", ""))
    role = str(facts.get("quantity", ""))
    if role == "acceleration" and on_impactor(position):
        role = f"{role}@{_IMPACTOR}"
    elif position == _MUZZLE and role in ("displacement", "voltage"):
        role = f"{role}@{_MUZZLE}"
    texts = {key: plain_text(facts[key]) for key in CHANNEL_KEYS if key in facts}
    return FormChannel(name, role, texts)


def _text(key: DescribedKey, value: Any) -> str:
    if key.keys in _LISTS and isinstance(value, list):
        return "\n".join(map(str, value))
    if key.keys[-1] == "outline_m" and isinstance(value, list):
        return "; ".join(", ".join(plain_text(part) for part in corner) for corner in value)
    return plain_text(value)


def description_of(form: FormTexts) -> CampaignDescription:
    """The description that a form states: what is empty is left out.

    Parameters:
        form: The texts of the form.
    """
    tables: dict[str, Any] = {}
    if form.kind:
        _put(tables, ("campaign", "kind"), KIND_IN_FILE.get(form.kind, form.kind))
    for key in (*FACTS, *BENCH, *READING):
        text = form.facts.get(key.name, "").strip()
        if text and (not form.kind or form.kind in key.kinds):
            _put(tables, key.keys, _value(key, text))
    if form.facts.get("campaign.date_unknown") and not form.facts.get("campaign.date"):
        _put(tables, ("campaign", "date"), UNKNOWN_DATE.isoformat())
    if form.confirmed:
        _put(tables, ("bench", "confirmed"), list(form.confirmed))
    channels = {
        channel.name: _facts(channel)
        for channel in form.channels
        if channel.role != NOT_USED and channel.name
    }
    tables["channels"] = channels
    force = {
        key.removeprefix("force."): text.strip()
        for key, text in form.facts.items()
        if key.startswith("force.") and text.strip()
    }
    if form.force_from:
        tables["force"] = {"from": list(form.force_from), **force}
    columns, rows = _table(form)
    factors = {c: form.free_factors[c] for c in columns if form.free_factors.get(c, "").strip()}
    if factors:
        tables["factors"] = factors
    return CampaignDescription({k: v for k, v in tables.items() if v}, columns, rows)


def _put(tables: dict[str, Any], keys: tuple[str, ...], value: Any) -> None:
    for key in keys[:-1]:
        tables = tables.setdefault(key, {})
    tables[keys[-1]] = value


def _value(key: DescribedKey, text: str) -> Any:
    if key.keys in _LISTS:
        return [line.strip() for line in text.splitlines() if line.strip()]
    if key.keys[-1] == "outline_m":
        return outline_of(text)
    return number_of(text, key.unit) if key.is_number else text


def _facts(channel: FormChannel) -> dict[str, Any]:
    quantity, _, position = channel.role.partition("@")
    facts: dict[str, Any] = {"quantity": quantity} if quantity else {}
    for key in CHANNEL_KEYS:
        text = channel.texts.get(key, "").strip()
        if text:
            facts[key] = number_of(text, "") if key in _CHANNEL_NUMBERS else text
    if position == _IMPACTOR and not on_impactor(facts.get("position")):
        facts["position"] = _IMPACTOR
    elif position and position != _IMPACTOR:
        facts["position"] = position
    return facts


def _table(form: FormTexts) -> tuple[tuple[str, ...], tuple[dict[str, str], ...]]:
    """Columns and rows of runs.csv: a column that no row fills is left out, but for those that the
    kind needs, and for those that a person has added."""
    usual = {column for own in COLUMNS.values() for column in own}
    added = [column for column in form.columns if column not in (*usual, RECORDING)]
    needed = (*KEYS, *NEEDED_COLUMNS.get(form.kind, ()), *added)
    of_kind = usual - set(COLUMNS.get(form.kind, ()))
    rows = []
    for row in form.rows:
        cells = {}
        for column in form.columns:
            if form.kind and column in of_kind:
                continue  # of another kind of campaign: the form does not show it
            cells[column] = " ".join((row.get(column) or form.shared.get(column, "")).split())
        rows.append({**cells, RECORDING: row.get(RECORDING, "").strip()})
    filled = [
        column
        for column in dict.fromkeys((*needed, *form.columns))
        if column in needed or any(row.get(column) for row in rows)
    ]
    columns = tuple(dict.fromkeys([*filled, RECORDING]))
    return columns, tuple({column: row.get(column, "") for column in columns} for row in rows)


def sent_form(texts: Texts) -> FormTexts:
    """The texts of a form from what its controls have sent.

    Parameters:
        texts: All texts of each control, by name.
    """

    def one(name: str) -> str:
        return next(iter(texts.get(name, ())), "").strip()

    columns = list(dict.fromkeys(text for text in texts.get("column", ()) if text))
    used = set(texts.get("use", ()))
    places = sorted(int(name.split(".")[1]) for name in texts if re.fullmatch(r"run\.\d+\.r", name))
    rows = [
        {column: one(f"run.{row}.{place}") for place, column in enumerate(columns)}
        | {RECORDING: one(f"run.{row}.r")}
        for row in places
        if str(row) in used
    ]
    shared = {column: one(f"all.{place}") for place, column in enumerate(columns)}
    free = {column: one(f"factor.{place}") for place, column in enumerate(columns)}
    added = " ".join(one("new_column").split())
    if added and added not in (*columns, RECORDING):
        columns.append(added)
    channels = sorted(
        int(name.split(".")[1]) for name in texts if re.fullmatch(r"channels\.\d+\.name", name)
    )
    named = (*FACTS, *BENCH, *READING)
    facts = {key.name: one(key.name) for key in named}
    facts |= {name: one(name) for name in texts if name.startswith("force.")}
    facts.pop("force.from", None)
    facts["campaign.date_unknown"] = one("campaign.date_unknown")
    for keys in _LISTS:
        facts[".".join(keys)] = "\n".join(texts.get(".".join(keys), ()))
    return FormTexts(
        one("kind"),
        facts,
        [
            FormChannel(
                one(f"channels.{place}.name"),
                one(f"channels.{place}.role"),
                {key: one(f"channels.{place}.{key}") for key in CHANNEL_KEYS},
            )
            for place in channels
        ],
        columns,
        {column: text for column, text in shared.items() if text},
        rows,
        (),
        {column: text for column, text in free.items() if text},
        tuple(texts.get("confirmed", ())),
        tuple(texts.get("force.from", ())),
        [row for row in places if str(row) in used],
    )


def free_columns(columns: Sequence[str]) -> list[str]:
    """Columns of the laboratory's own: those of no known meaning.

    Parameters:
        columns: Columns of the table of runs.
    """
    return [column for column in columns if column not in (*KNOWN, RECORDING)]


#: Faults of the ingest: where in the two files they are.
_OF_KEY = re.compile(r"campaign\.toml: ((?:campaign|bench|recordings|force)\.[\w.]*\w)")
_OF_CELL = re.compile(r"runs\.\w+: row (\d+), column '([^']*)'")
_OF_ROW = re.compile(r"runs\.\w+: row (\d+)")
_OF_COLUMN = re.compile(r"runs\.\w+: (?:no )?column '([^']*)'")
_LABELS = {key.name: key.label for key in (*FACTS, *BENCH, *READING)}


def control_of(fault: str, form: FormTexts) -> tuple[str, str]:
    """The control that a fault of the ingest is about ("" where it is about none), and the fault in
    the words of the form.

    Parameters:
        fault: A line of an `IngestError`.
        form: The form whose files were refused.
    """
    for place, channel in enumerate(form.channels):
        start = f"campaign.toml: channels.{channel.name}"
        if fault.startswith((f"{start}.", f"{start}:", f"{start} ")):
            key = fault.removeprefix(start).lstrip(".:").split(" ")[0].split(":")[0]
            control = key if key in CHANNEL_KEYS else "role" if key == "quantity" else "unit"
            words = fault.removeprefix(start).lstrip(".: ")
            return f"channels.{place}.{control}", f"Channel {channel.name}: {words}"
    if match := _OF_KEY.match(fault):
        name = match[1]
        label = _LABELS.get(name, name)
        return name, fault.replace(f"campaign.toml: {name}", label, 1)
    columns = list(form.columns)
    if match := _OF_CELL.match(fault):
        row, column = int(match[1]) - 2, match[2]
        words = f"Run {row + 1} of the table, {fault.split(', ', 1)[1]}"
        if column == RECORDING:
            return f"run.{_place(form, row)}.r", words
        if column in columns and row < len(form.rows):
            place = columns.index(column)
            is_own = bool(form.rows[row].get(column)) or column in KEYS
            return (f"run.{_place(form, row)}.{place}" if is_own else f"all.{place}"), words
    if (match := _OF_COLUMN.match(fault)) and match[1] in columns:
        place = columns.index(match[1])
        return (f"factor.{place}" if match[1] not in KNOWN else f"all.{place}"), fault
    if match := _OF_ROW.match(fault):
        return f"run.{_place(form, int(match[1]) - 2)}.0", fault
    return "", fault.removeprefix("campaign.toml: ")


def _place(form: FormTexts, row: int) -> int:
    """Where a row of the table stands on the page, which has those that are not used, too."""
    return form.places[row] if 0 <= row < len(form.places) else row


#: Roles of channels for a select: value and words.
ROLE_CHOICES = tuple((role.value, role.words) for role in ROLES)
