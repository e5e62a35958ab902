"""Batches of shots and impacts beside loops of solve_ivp, with few of each."""

from __future__ import annotations

from benchmarks import gun, impacts


def test_shots_agree_and_are_timed():
    race = gun.race(gun.three_effects, shots=200, peer_shots=3, repeats=2)
    assert race.difference <= gun.ACCURACY
    assert race.by.method in gun.METHODS and race.by.evaluations > 20
    assert len(race.ours) == len(race.peer) == len(race.limit) == 2 and min(race.limit) > 0
    figure = gun.figure(race, "few shots", None)
    assert figure.value.median > 1 and figure.near.median > 0.5


def test_impacts_agree_and_are_timed():
    speed, *errors, worst = impacts.measure_impacts(None, count=60, each=20, repeats=2)
    assert speed.near.median > 0.5
    assert len(errors) == 4 and all(figure.of == "quality" for figure in errors)
    assert worst.holds
