"""Pulses over each other: known half-sines by a factor, their mean and their spread."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.app.impacts.overlays import pulse_overlay
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.conditions import UnknownFieldError
from pyroshock.schema.configurations import configuration_id
from pyroshock.schema.impacts import ExtractionSettingsRow, Impact
from pyroshock.schema.known_factors import RunLevel
from pyroshock.schema.listings import Condition
from pyroshock.schema.series import encode
from pyroshock.schema.session import Writer, open_store
from support.stores.recorded import WHEN, pulse_row

#: tip radius (m; None: not recorded), peak (N), contact time (s)
MADE = (
    (0.03, 100.0, 1e-3), (0.03, 300.0, 1e-3), (0.03, 200.0, 1e-3), (0.015, 500.0, 2e-3), (0.015, 500.0, 0.5e-3),
    (None, 50.0, 1e-3),
)  # fmt: skip


def half_sine(share):
    return np.sin(np.pi * np.clip(share, 0, 1))


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    url = f"sqlite:///{tmp_path_factory.mktemp('overlay') / 'lab.db'}"
    with open_store(url, Writer("test", "0"), create=True) as store:
        with store.writing() as session:
            session.add(Campaign(id=1, name="c", kind="hammer", date=WHEN.date(), fingerprint="c"))
            session.add(ExtractionSettingsRow(id=1, fingerprint="1", code_version=1, settings={}))
            for key, (radius, peak, contact) in enumerate(MADE, 1):
                levels = [RunLevel("tip_material", "steel")]
                levels += [] if radius is None else [RunLevel("tip_radius", repr(radius), radius, "m")]
                configuration = configuration_id(session, levels)
                session.add(Impact(id=key, campaign_id=1, run=key, repetition=1, configuration_id=configuration))
                session.flush()
                fine = np.linspace(0, 1, 401)
                curve = encode(peak * half_sine(fine))
                session.add(pulse_row(key, contact_time_s=contact, fine_period_s=contact / 400, peak_force_n=peak,
                                      fine_force_n=curve))  # fmt: skip
        yield store


def overlay(store, factor="tip_radius", where=(), campaign="c", **named):
    with store.reading() as session:
        return pulse_overlay(session, campaign, where, factor, **named)


def test_pulses_are_grouped_by_level_with_mean_and_deviation(store):
    found = overlay(store)
    assert [(group.level, group.count) for group in found.groups] == [(0.015, 2), (0.03, 3), (None, 1)]
    assert [group.impacts for group in found.groups] == [(4, 5), (1, 2, 3), (6,)]
    assert (found.factor, found.drawn, found.matching, found.thinned) == ("tip_radius_m", 6, 6, False)
    found = overlay(store, points=101)
    group = found.groups[1]
    shape = half_sine(found.axis / 1e-3)
    np.testing.assert_allclose(group.mean_n, 200 * shape, atol=0.05)
    np.testing.assert_allclose(group.deviation_n, 100 * shape, atol=0.05)
    assert np.isnan(found.groups[2].deviation_n).all()


def test_axis_is_time_or_the_share_of_the_contact(store):
    found = overlay(store, points=201)
    assert (found.axis_name, found.axis[0], found.axis[-1]) == ("time_s", 0.0, 2e-3)
    long, short = found.groups[0].force_n
    np.testing.assert_allclose(long, 500 * half_sine(found.axis / 2e-3), atol=0.1)
    assert (short[found.axis > 0.5e-3] == 0).all()
    assert short.max() == pytest.approx(500.0, rel=1e-3)
    found = overlay(store, points=51, normalised=True)
    assert (found.axis_name, found.axis[-1]) == ("share_of_contact", 1.0)
    long, short = found.groups[0].force_n
    np.testing.assert_allclose(long, short, atol=1e-9)
    np.testing.assert_allclose(long, 500 * half_sine(found.axis), atol=0.1)
    np.testing.assert_allclose(found.groups[0].deviation_n, 0, atol=1e-9)


def test_pulses_are_thinned_filtered_and_counted(store):
    found = overlay(store, most=3)
    assert (found.drawn, found.matching, found.thinned) == (3, 6, True)
    assert sum(group.count for group in found.groups) == 3
    where = (Condition("peak_force_n", ">", 150.0),)
    assert overlay(store, where=where, campaign=None).matching == 4
    none = overlay(store, where=(Condition("peak_force_n", ">", 1e9),))
    assert (none.groups, none.drawn, none.matching) == ((), 0, 0)


def test_unknown_factor_lists_the_known_and_one_point_is_no_curve(store):
    with pytest.raises(UnknownFieldError, match=r"'colour'.*tip_material, tip_radius"):
        overlay(store, "colour")
    with pytest.raises(ValueError, match="points is 1"):
        overlay(store, points=1)
