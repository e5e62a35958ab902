"""Datasets, models and predictions whose data were taken out of the store say so; damage is no withdrawal."""

from __future__ import annotations

import json

import pytest
from support.stores.care_stores import HAMMER, execute
from support.stores.hammer_stores import HITS
from support.stores.stores import pyroshock

FIRST = "recordings/test-01.npz"
REASON = "the plate had come loose"


def done(url, *arguments, code=0):
    result = pyroshock(*arguments, "--db", url)
    assert result.exit_code == code, result.output
    return result


def discard(url):
    done(url, "runs", "discard", HAMMER, FIRST, "--reason", REASON)


def test_list_of_datasets_tells_what_was_withdrawn(care_store):
    assert json.loads(done(care_store, "dataset", "--json").stdout)[0]["withdrawn"] == 0
    discard(care_store)
    told = done(care_store, "dataset")
    assert f"{HITS} of the {2 * HITS} pulses of dataset small" in told.stderr and REASON in told.stderr
    assert json.loads(done(care_store, "dataset", "--json").stdout)[0]["withdrawn"] == HITS
    shown = done(care_store, "dataset", "show", "small", code=2).stderr
    assert f"pyroshock ingest FOLDER --again {FIRST}" in shown


def test_dataset_that_lost_more_than_a_tombstone_explains_is_damage(care_copy):
    discard(care_copy)
    done(care_copy, "db", "check")
    execute(care_copy, "DELETE FROM snapshot_pulses WHERE pulse_id = (SELECT max(pulse_id) FROM snapshot_pulses)")
    check = done(care_copy, "db", "check", code=1)
    assert check.stdout.startswith("datasets: dataset small: ")


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ("UPDATE tombstones SET restored_at = deleted_at WHERE kind = 'recording'", "was stored again by what"),
        (f"UPDATE tombstones SET replaced_by = '{'1' * 64}' WHERE kind = 'recording'", "a file that is not in the"),
        ("UPDATE tombstones SET restored_at = deleted_at WHERE kind = 'campaign'", "the campaign was restored by"),
        (
            "UPDATE tombstones SET recording = (SELECT path FROM recordings WHERE campaign_id = 1), "
            "file_sha256 = (SELECT sha256 FROM recordings WHERE campaign_id = 1) WHERE kind = 'recording'",
            "was discarded, and is in the store all the same",
        ),
    ],
)
def test_tombstone_that_says_what_is_not_so_is_a_fault(care_store, statement, message):
    discard(care_store)
    done(care_store, "db", "check")
    execute(care_store, statement)
    check = done(care_store, "db", "check", "--fast", code=1)
    assert check.stdout.startswith("tombstones: ") and message in check.stdout


@pytest.mark.slow
def test_models_of_such_a_dataset_and_what_they_predict_say_so(care_copy):
    done(care_copy, "train", "small", "--models", "hann,hertz")
    for words in (["models"], ["compare", "hann", "hertz"], ["predict", "--velocity", "1m/s", "--contact", "hann@1"]):
        assert "no longer whole" not in pyroshock(*words, "--db", care_copy).stderr
    discard(care_copy)
    told = done(care_copy, "models")
    assert "trained on data that is no longer whole" in told.stderr and REASON in told.stderr
    rows = json.loads(done(care_copy, "models", "--json").stdout)
    assert {row["withdrawn_pulses"] for row in rows} == {HITS}
    predicted = done(care_copy, "predict", "--velocity", "1m/s", "--contact", "hann@1")
    assert "hann@1 was trained on data that is no longer whole" in predicted.stderr
    assert REASON in pyroshock("compare", "hann", "hertz", "--db", care_copy).stderr
