"""The experiment that a diagnosis names, as a plan: settings that tell causes apart, ready for the
run sheet."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sqlalchemy import select

from ....dataset.rows import gun_bench
from ....doe.designs.base import Design
from ....doe.factors import number_label
from ....doe.guards import PlannedShot, check_run
from ....doe.limits.bench import BenchLimits
from ....doe.limits.contact_force import Elastic, hertz_contact
from ....doe.plans import StoredPlan, add_plan, read_plan
from ....doe.space import space_from_text
from ....schema.benches import Material, material_names
from ....schema.campaigns import Campaign
from ....schema.configurations import configuration_factors
from ....schema.impacts import Impact, Shot
from ....schema.known_factors import BY_COLUMN, BY_NAME
from ....schema.listings import get_campaign_id
from ....twin.gun.nominal import muzzle_velocity

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from ....schema.session import Store
    from ....twin.gun.bench import GunBench

METHOD = "discriminate"
Level = str | float
Row = Mapping[str, str]


@dataclass(frozen=True)
class Experiment:
    """Runs of a plan: a table's row each, how often it is fired, and why. `left_out`: runs beyond
    the bench."""

    kind: str
    rows: tuple[Row, ...]
    repetitions: tuple[int, ...]
    why: str
    left_out: tuple[str, ...] = ()


def store_experiment(
    store: Store, campaign: str, next_runs: Sequence[Mapping[str, Any]], name: str
) -> tuple[StoredPlan, tuple[str, ...]]:
    """Plan `name` of the next runs of a report, each a run with as many repetitions as are needed;
    and what it lacks.

    Factors that a setting leaves open are the campaign's most frequent level. A gun's runs that the
    bench does not withstand are left out. Raises `doe.plans.PlanExistsError`, and `ValueError`
    where no run is left.
    """
    with store.reading() as session:
        experiment = _experiment(session, campaign, next_runs)
    text = factors_toml(experiment.kind, experiment.rows)
    space = space_from_text(text)
    add_plan(
        store,
        name,
        text,
        Design(space, space.treatments(experiment.rows), METHOD, None),
        repetitions=experiment.repetitions,
        description=f"diagnosis of {campaign}: {experiment.why}",
    )
    with store.reading() as session:
        return read_plan(session, name), experiment.left_out


def plan_name(campaign: str) -> str:
    """What the plan is called where nobody names it."""
    return f"{campaign}-{METHOD}"


def no_setting(campaign: str) -> str:
    """What to say of a diagnosis without next runs."""
    return (
        f"the diagnosis of {campaign} names no setting that separates causes; its report says what "
        f"to do next (pyroshock diagnose {campaign})"
    )


def _experiment(
    session: Session, campaign: str, next_runs: Sequence[Mapping[str, Any]]
) -> Experiment:
    if not next_runs:
        raise ValueError(no_setting(campaign))
    row = session.get_one(Campaign, get_campaign_id(session, campaign))
    rows = _rows(next_runs, _usual_levels(session, row))
    left_out: tuple[str, ...] = ()
    if row.gun is not None:
        beyond = _unsafe_rows(rows, gun_bench(row.gun), _elastic(session))
        left_out = tuple(
            f"left out, beyond the bench: {_words(rows[i])}: {why}" for i, why in beyond.items()
        )
        rows = [cells for i, cells in enumerate(rows) if i not in beyond]
        next_runs = [run for i, run in enumerate(next_runs) if i not in beyond]
    if not rows:
        raise ValueError(
            f"every run that would tell causes of {campaign} apart is beyond "
            f"the bench: {left_out[0]}"
        )
    shots: dict[tuple[tuple[str, str], ...], int] = {}
    for cells, run in zip(rows, next_runs, strict=True):
        key = tuple(cells.items())
        shots[key] = max(1, int(run["runs_needed"]), shots.get(key, 0))
    why = "; ".join(dict.fromkeys(str(run["why"]) for run in next_runs))
    return Experiment(row.kind, tuple(map(dict, shots)), tuple(shots.values()), why, left_out)


def _rows(next_runs: Sequence[Mapping[str, Any]], usual: Row) -> list[Row]:
    """A table of runs; `usual` levels where a setting says nothing."""
    settings = [dict(_cells(run["settings"])) for run in next_runs]
    given = list(dict.fromkeys(column for cells in settings for column in cells))
    kept = {
        column: cell for column, cell in usual.items() if column in given or column in BY_COLUMN
    }
    rows: list[Row] = [
        {column: {**kept, **cells}.get(column, "") for column in (*given, *kept)}
        for cells in settings
    ]
    for row in rows:
        if missing := [column for column, cell in row.items() if not cell]:
            raise ValueError(
                f"a setting of the next experiment leaves "
                f"{missing[0]} open, and the campaign has none"
            )
    return rows


def _words(row: Row) -> str:
    return ", ".join(f"{column} {cell}" for column, cell in row.items())


def _cells(settings: Mapping[str, Level]) -> Iterator[tuple[str, str]]:
    """Columns of a table of runs; a factor by its own name is SI."""
    for key, value in settings.items():
        factor = BY_NAME.get(key) if key not in BY_COLUMN else None
        if factor is not None and not isinstance(value, str):
            yield factor.column, number_label(value / factor.scale)
        else:
            yield (
                factor.column if factor else key,
                value if isinstance(value, str) else number_label(value),
            )


def _usual_levels(session: Session, campaign: Campaign) -> dict[str, str]:
    """The most frequent level of each factor that recordings of the campaign set, as a table writes
    it."""
    table = Shot if campaign.kind == "gun" else Impact
    runs = Counter(
        session.scalars(select(table.configuration_id).where(table.campaign_id == campaign.id))
    )
    counts: dict[str, Counter[Level]] = {}
    for key, levels in configuration_factors(session, list(runs)).items():
        for name, level in levels.items():
            counts.setdefault(name, Counter())[level] += runs[key]
    return dict(_cells({name: levels.most_common(1)[0][0] for name, levels in counts.items()}))


def factors_toml(kind: str, rows: Sequence[Row]) -> str:
    """A space of exactly the levels of these rows, as its TOML file (`doe.toml_space`)."""
    parts = [f'name = "{METHOD}"', f'kind = "{kind}"']
    for column in dict.fromkeys(column for row in rows for column in row):
        factor = BY_COLUMN.get(column)
        cells = [row[column] for row in rows]
        numeric = factor.is_number if factor else all(map(_is_number, cells))
        parts += [
            "",
            "[[factors]]",
            f"name = {_text(factor.name if factor and numeric else column)}",
        ]
        parts += [f"column = {_text(column)}"] if factor and numeric else []
        parts += [f'kind = "{"numeric" if numeric else "categorical"}"']
        if numeric:
            parts += [f"unit = {_text(column.rsplit('_', 1)[-1] if factor else '1')}"]
            parts += [f"levels = [{', '.join(sorted(set(cells), key=float))}]"]
        else:
            parts += [f"levels = [{', '.join(map(_text, dict.fromkeys(cells)))}]"]
    return "\n".join(parts) + "\n"


def _text(word: str) -> str:
    """A TOML string: JSON's escapes are TOML's."""
    return json.dumps(word, ensure_ascii=False)


def _is_number(cell: str) -> bool:
    try:
        return number_label(float(cell)) == cell
    except ValueError:
        return False


def _elastic(session: Session) -> dict[str, Elastic]:
    """Elastic constants by every name of a material, in lower case."""
    constants = {
        m.name: Elastic(m.youngs_modulus_pa, m.poisson_ratio)
        for m in session.scalars(select(Material))
    }
    names = material_names(session)
    return {
        word.lower(): constants[name] for word in constants if (name := names(word)) is not None
    }


def _unsafe_rows(
    rows: Sequence[Row], bench: GunBench, materials: Mapping[str, Elastic]
) -> dict[int, str]:
    """Rows that the bench does not withstand, or that never leave the barrel, and why."""
    reasons = {}
    for i, row in enumerate(rows):
        shot = _shot(row, bench, materials)
        exceeded = [] if shot is None else check_run(shot, BenchLimits())
        if shot is None or exceeded:
            why = ", ".join(item.message for item in exceeded)
            reasons[i] = why or "the bullet does not leave the barrel of the nominal gun"
    return reasons


def _shot(row: Row, bench: GunBench, materials: Mapping[str, Elastic]) -> PlannedShot | None:
    """What the nominal gun and an elastic contact, both on the safe side, expect; None where
    nothing is shot.

    What a setting leaves open of the contact is taken at its stiffest: steel on steel, a radius of
    60 mm.
    """
    pressure, mass = 1e5 * float(row["tank_pressure_bar"]), float(row["bullet_mass_kg"])
    velocity = float(muzzle_velocity(bench, pressure, mass))
    if not velocity > 0:
        return None
    plate, anvil = row.get("plate_material", "steel"), row.get("anvil_material", "none")
    contact = hertz_contact(
        materials[row.get("tip_material", "steel").lower()],
        materials[(plate if anvil == "none" else anvil).lower()],
        tip_radius_m=1e-3 * float(row.get("tip_radius_mm", 60)),
        bullet_mass_kg=mass,
        impact_velocity_m_s=velocity,
    )
    peak, time = contact.peak_force_n, contact.contact_time_s
    return PlannedShot(_words(row), pressure, mass, velocity, plate, anvil, peak, time)
