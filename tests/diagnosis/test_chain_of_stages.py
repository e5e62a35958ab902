"""Which stages of a campaign are diagnosed, what is said of those that are not, and which options
are refused."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pyroshock.diagnosis.chain import stages_of
from pyroshock.diagnosis.options import Options
from support.records.contact_campaigns import hammer_record
from support.records.gun_shots import shots
from support.records.plate_records import played


def test_what_is_missing_for_a_stage_is_said() -> None:
    record = replace(hammer_record(), plate=None)
    ringing = tuple(
        replace(run, accelerations=played().runs[0].accelerations) for run in record.runs
    )
    stages, notes = stages_of(replace(record, runs=ringing), Options())
    assert [stage.name for stage in stages] == ["contact"]
    assert notes[-1].startswith("plate: not diagnosed, since the campaign gives neither")
    _, notes = stages_of(hammer_record(), Options())
    assert notes == (
        "gun: no [bench.gun] in the campaign",
        "plate: no run has an acceleration record that can be used",
    )
    # A gun's campaign with forces, whose table of runs says nothing of tips, still has its
    # velocities.
    force = hammer_record().runs[0].force
    record = shots()
    runs = tuple(replace(run, force=force) for run in record.runs)
    stages, notes = stages_of(replace(record, runs=runs), Options())
    assert [stage.name for stage in stages] == ["gun"]
    assert any(note.startswith("contact: not diagnosed: configuration") for note in notes)
    with pytest.raises(
        ValueError,
        match=r"uncertain gun\.efficiency cannot act on this campaign: gun: no \[bench\.gun\]",
    ):
        stages_of(hammer_record(), Options(uncertain={"gun.efficiency": 0.01}))
    record = hammer_record()
    runs = tuple(replace(run, force=None) for run in record.runs)
    with pytest.raises(
        ValueError,
        match=r"nothing to compare: gun: .*; contact: no run has a force record .*; plate: ",
    ):
        stages_of(replace(record, runs=runs), Options())


def test_one_configuration_is_refused_and_two_are_enough() -> None:
    record = shots()
    alone = tuple(
        run if run.configuration == 3 else replace(run, velocity_m_s=None) for run in record.runs
    )
    with pytest.raises(
        ValueError,
        match=r"all 4 runs that can be compared are of one configuration \(60000, 0.25\)",
    ):
        stages_of(replace(record, runs=alone), Options())
    two = tuple(
        run if run.configuration < 2 else replace(run, velocity_m_s=None) for run in record.runs
    )
    (stage,), _ = stages_of(replace(record, runs=two), Options())
    assert stage.name == "gun"


@pytest.mark.parametrize(
    "name", ["plate.magic", "gnu.friction_coefficient", "friction_coefficient"]
)
def test_uncertainty_of_no_stage_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=name):
        Options(uncertain={name: 0.1})


def test_uncertainties_go_to_their_stage() -> None:
    options = Options(uncertain={"gun.travel_m": 0.01, "contact.impactor_mass_kg": 0.02})
    assert options.uncertain_of("gun") == {"travel_m": 0.01}
    assert options.uncertain_of("contact") == {"impactor_mass_kg": 0.02}
    with pytest.raises(ValueError, match="laser"):
        Options(tolerances={"laser": 0.1})
