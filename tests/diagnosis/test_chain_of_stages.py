"""Which stages of a campaign are diagnosed, and what is said of those that are not."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pyroshock.diagnosis.chain import stages_of
from pyroshock.diagnosis.options import Options
from support.records.contact_campaigns import hammer_record
from support.records.gun_shots import shots
from support.records.plate_records import played


def test_plate_without_a_modal_table_says_how_to_give_one() -> None:
    record = replace(hammer_record(), plate=None)
    ringing = tuple(replace(run, accelerations=played().runs[0].accelerations) for run in record.runs)
    stages, notes = stages_of(replace(record, runs=ringing), Options())
    assert [stage.name for stage in stages] == ["contact"]
    assert notes[-1].startswith("plate: not diagnosed, since the campaign gives neither")


def test_plate_without_accelerations_needs_them_first() -> None:
    _, notes = stages_of(hammer_record(), Options())
    assert notes == ("gun: no [bench.gun] in the campaign", "plate: no run has an acceleration record that can be used")


def test_nothing_measured_is_refused_with_the_reason_of_every_stage() -> None:
    record = hammer_record()
    runs = tuple(replace(run, force=None) for run in record.runs)
    with pytest.raises(
        ValueError, match=r"nothing to compare: gun: .*; contact: no run has a force record .*; plate: "
    ):
        stages_of(replace(record, runs=runs), Options())


def test_a_contact_that_the_record_does_not_describe_leaves_the_gun() -> None:
    """A gun's campaign with forces, whose table of runs says nothing of tips, still has its velocities."""
    force = hammer_record().runs[0].force
    record = shots()
    runs = tuple(replace(run, force=force) for run in record.runs)
    stages, notes = stages_of(replace(record, runs=runs), Options())
    assert [stage.name for stage in stages] == ["gun"]
    assert any(note.startswith("contact: not diagnosed: configuration") for note in notes)


def test_an_uncertain_number_of_a_stage_that_is_not_there_is_refused() -> None:
    with pytest.raises(
        ValueError, match=r"uncertain gun\.efficiency cannot act on this campaign: gun: no \[bench\.gun\]"
    ):
        stages_of(hammer_record(), Options(uncertain={"gun.efficiency": 0.01}))


def test_one_configuration_is_refused_with_its_runs() -> None:
    record = shots()
    alone = tuple(run if run.configuration == 3 else replace(run, velocity_m_s=None) for run in record.runs)
    with pytest.raises(ValueError, match=r"all 4 runs that can be compared are of one configuration \(60000, 0.25\)"):
        stages_of(replace(record, runs=alone), Options())


def test_two_configurations_are_enough() -> None:
    record = shots()
    two = tuple(run if run.configuration < 2 else replace(run, velocity_m_s=None) for run in record.runs)
    (stage,), _ = stages_of(replace(record, runs=two), Options())
    assert stage.name == "gun"
