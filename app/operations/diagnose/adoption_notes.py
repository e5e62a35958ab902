"""What to tell of effects that were adopted from a diagnosis."""

from __future__ import annotations

from collections.abc import Iterator

from ....diagnosis.verdict import Verdict
from ....schema.diagnoses import TwinVersion
from ....twin.effects import effect_from_json
from ...twins.adopted_effects import offered
from .wording import cause_name, spell_sets


def adoption_notes(verdict: Verdict, version: TwinVersion) -> Iterator[str]:
    """What predictions use from this version on, and whether the diagnosis says something else
    first."""
    configuration = version.configuration
    if not configuration["effects"]:
        yield (
            f"nothing is adopted from version {version.version} on: predict and tune use the "
            f"nominal {', '.join(configuration['stages'])}"
        )
        return
    effects = {effect_from_json(table).id for table in configuration["effects"]}
    best = offered(verdict)
    is_offered = (
        best is not None
        and {effect.id for effect in best.effects} == effects
        and best.is_averaged == ("gun_choices" in configuration)
    )
    if not is_offered and effects not in [set(name.split("+")) for name in verdict.first.effects]:
        names = "+".join(effect_from_json(table).id for table in configuration["effects"])
        yield (
            f"{spell_sets(names)} is not what the diagnosis says first: {cause_name(verdict.first)}"
        )
    yield (
        f"adopted as version {version.version}: {spell_sets(version.reason)}; predict and tune use "
        "it (--no-adopted: without)"
    )
