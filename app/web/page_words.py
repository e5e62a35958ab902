"""Messages as pages say them: pages name fields and buttons, the command line names options and
commands. A message is made once, in the words of the command line, and put into these here.

Folders of the server are called by their last part: where they lie is nobody's business.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from pathlib import Path

#: Parts of messages that have words of their own on pages, the longest first.
_PHRASES: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), words)
    for pattern, words in (
        (
            r"or replace it: pyroshock runs replace .*? --reason TEXT",
            "or discard the recording on the page of one of its impacts, and ingest the folder "
            "again",
        ),
        (
            r"confirm it with --confirm (\S+) or with confirmed = \[\"\1\"\] in \[bench\](?: of "
            r"campaign\.toml)?",
            r"tick the rule \1 in the form of the campaign",
        ),
        (
            r"declare it in campaign\.toml \(\[factors\], [^)]*\) or confirm it with "
            r"--free-factor (\S+)",
            r"say in the form of the campaign what it is, or name it in the field “Free factors”",
        ),
        (r" ?\(pyroshock materials lists and adds them\)", ""),
        (r"docs/reference/campaigns\.md", "the form of a campaign says what it needs"),
        (r" The option can be repeated\.", " Separate several by commas."),
        (r"`runs discard`", "somebody"),
        (
            r"pyroshock diagnose (?:'[^']*'|\S+) --adopt (\S*[^\s.,;)])",
            r"choose \1 and press “Adopt” on the page of the diagnosis",
        ),
        (r"diagnose again \(pyroshock diagnose (?:'[^']*'|[^\s)]+)\)", "diagnose it again"),
        (r"Add --(replicates|blocks) (\d+)\.", r"Make the plan with --\1 \2."),
        (r"; larger campaigns: pyroshock ingest FOLDER", ""),
        (r"; more than ([\d,]+) go by pyroshock ingest FOLDER", r"; at most \1 go at a time"),
        (r"; pyroshock ingest FOLDER takes them", "; ask whoever operates the server"),
        (r"\(pyroshock work --data FOLDER\)", "(whoever operates the server can allow it)"),
    )
)
#: First words of a command -> where a page does the same.
_PLACES = {
    "campaigns delete": "the button “Delete” of the campaign",
    "campaigns restore": "the page “Deleted and archived campaigns”",
    "campaigns": "the page “Campaigns”",
    "compare": "the page “Compare models”",
    "dataset": "the page “Datasets”",
    "datasets": "the page “Datasets”",
    "db check": "a check of the store by whoever operates the server",
    "db import": "an import by whoever operates the server",
    "db": "whoever operates the server",
    "demo": "whoever operates the server",
    "diagnose": "the page “Diagnoses”",
    "diagnoses": "the page “Diagnoses”",
    "export": "the button “Export” of the campaign",
    "extract": "the button “Extract again” of the campaign",
    "impacts": "the page “Impacts”",
    "ingest": "the page “Ingest”",
    "jobs": "the page “Jobs”",
    "models": "the page “Models”",
    "plan": "the page “Plans”",
    "plans": "the page “Plans”",
    "predict": "the page “Twin”",
    "promote": "the button “Promote” of the model",
    "report": "the button “Report”",
    "runs": "the page of the impact",
    "show": "the page of the impact",
    "shots": "the page “Shots”",
    "train": "the page “Train models”",
    "tune": "the page “Tune”",
    "validate": "the page “Validation”",
    "work": "whoever operates the server",
}
_COMMAND = re.compile(r"`?\bpyroshock ((?:[a-z]+[- ]?)+)(?:[^`;,)\n]*[A-Z\d][^`;,)\n]*)?`?")
#: An option, with what stands behind it in capitals.
_OPTION = re.compile(r"(?<![\w-])--([a-z]+(?:-[a-z]+)*)(?: [A-Z]{2,}\b)?")
#: An option with its number: a field is set to it.
_NUMBERED_OPTION = re.compile(r"(?<![\w-])--([a-z]+(?:-[a-z]+)*) (\d+(?:\.\d+)?)\b")
#: Options that a form calls otherwise than by their own words.
_LABELS = {
    "confirm": "Confirmed",
    "free-factor": "Free factors",
    "from": "Campaigns",
    "separation": "Separation s",
    "velocity-target-motion": "Target motion",
    "with": "With effects",
    "without": "Without effects",
}


def in_page_words(text: str, folders: Sequence[Path] = ()) -> str:
    """A message in the words of pages.

    Parameters:
        text: The message in the words of the command line.
        folders: Folders of the server, which the message may name; the folder of uploads is one of
            them without being given.

    Returns:
        The message: options are fields, commands are pages, and paths below the folders begin with
        the last part of the folder.
    """
    for pattern, words in _PHRASES:
        text = pattern.sub(words, text)
    text = _COMMAND.sub(_place, text)
    text = _NUMBERED_OPTION.sub(_label_with_number, text)
    text = _OPTION.sub(_label, text)
    return _without_paths(text, folders)


def _place(match: re.Match[str]) -> str:
    words = match[1].split()
    for count in (2, 1):
        place = _PLACES.get(" ".join(words[:count]))
        if place is not None:
            return place
    return "the command line"


def _label_with_number(match: re.Match[str]) -> str:
    return f"{_label(match)} set to {match[2]}"


def _label(match: re.Match[str]) -> str:
    name = match[1]
    return f"“{_LABELS.get(name, name.replace('-', ' ').capitalize())}”"


def _without_paths(text: str, folders: Sequence[Path]) -> str:
    scratch = Path(tempfile.gettempdir())
    # an upload's own folder has a name that says nothing
    text = re.sub(rf"{re.escape(str(scratch))}/pyroshock-[a-z]+-[^/\s:;,'\"]+/?", "", text)
    for folder in folders:
        text = text.replace(str(folder.resolve()), folder.name)
    return text
