"""Whether every installed package may be used on our terms: `make licences`; `--list` prints each
with its licence.

Only what is installed can be asked: with the extra `dev`, that is all that constraints.txt pins.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping
from importlib.metadata import Distribution, distributions
from pathlib import Path
from typing import Any

OWN = "pyroshock"
RULES = Path(__file__).with_name("licences.toml")
#: Between the names of an SPDX expression; of alternatives we would have to choose one, so all must
#: do.
_JOINTS = re.compile(r"\s+(?:AND|OR|WITH)\s+|[()]")
#: Classifiers that name no licence.
_EMPTY = ("OSI Approved", "DFSG approved")


def licence_of(package: Distribution, called: Mapping[str, str]) -> str:
    """The SPDX expression that a package's metadata give, made of its classifiers where they are
    older; "" for none."""
    about = package.metadata
    if "License-Expression" in about:
        return about["License-Expression"]
    classifiers = [
        each.split(" :: ")[-1]
        for each in about.get_all("Classifier") or []
        if each.startswith("License ::")
    ]
    named = sorted({called.get(each, each) for each in classifiers if each not in _EMPTY})
    text = about["License"].strip() if "License" in about else ""
    if named or not text:
        return " AND ".join(named)
    return called.get(text, text) if "\n" not in text else ""


def objections(found: Mapping[str, str], rules: Mapping[str, Any]) -> Iterator[str]:
    """What is wrong, a line each. `found`: package -> licence; `rules`: the content of
    `licences.toml`."""
    for name, licence in found.items():
        reviewed = rules["reviewed"].get(name)
        if reviewed is not None:
            if reviewed["says"] != licence:
                yield (
                    f"{name}: {licence or 'no licence'}; reviewed as "
                    f"{reviewed['says'] or 'none'}: look again"
                )
        elif not licence:
            yield (
                f"{name}: its metadata name no licence; read it, and enter it in "
                f"{RULES.name} with the reason"
            )
        elif refused := [
            part for part in _JOINTS.split(licence) if part and part not in rules["allowed"]
        ]:
            yield f"{name}: {licence}; {', '.join(refused)} is not allowed"


def main(words: list[str]) -> int:
    """0: all may be used; 1: some may not, and why."""
    rules = tomllib.loads(RULES.read_text(encoding="utf-8"))
    packages = {
        each.name.lower().replace("_", "-"): each for each in distributions() if each.name != OWN
    }
    found = {name: licence_of(packages[name], rules["called"]) for name in sorted(packages)}
    if "--list" in words:
        for name, licence in found.items():
            print(f"{name:<32} {packages[name].version:<18} {licence or 'see its LICENSE'}")
    wrong = list(objections(found, rules))
    for line in wrong:
        print(f"licences: {line}", file=sys.stderr)
    by_licence = Counter(found.values())
    print(f"licences: {len(found)} packages, {len(by_licence)} licences, {len(wrong)} objections")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
