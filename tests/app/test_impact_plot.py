"""The figure of `show N --plot`: the record beside the contact, arrays of load cells with their
sum, records without contact."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.app.operations.impacts import impact_plot
from pyroshock.app.operations.impacts.impact_plot import (
    impact_figure,
    pulse_plot,
    record_plot,
)
from pyroshock.ingest.load import ingest_folder
from pyroshock.ingest.storing.stored_channels import list_channels
from pyroshock.schema.impacts import Impact, Pulse
from sqlalchemy import delete, select
from support.checks.drawn_series import named_series, series_of
from support.records.campaigns import (
    blows,
    force_record,
    hammer_campaign,
    recording_name,
    write_recording,
)
from support.stores.stores import opened

CELLS = """
[channels.{name}]
quantity = "force"
unit = "N"
"""


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """Two recordings of a hammer: of a single cell, and of four cells that share the force."""
    folder = tmp_path_factory.mktemp("plot")
    single, array = hammer_campaign(folder / "single", 1), hammer_campaign(folder / "array", 1)
    toml = array / "campaign.toml"
    text = (
        toml.read_text()
        .replace("[channels.force]", "[channels.cell_1]")
        .replace('name = "hammer"', 'name = "array"')
    )
    toml.write_text(text + "".join(CELLS.format(name=f"cell_{number}") for number in (2, 3, 4)))
    force = force_record(blows(1, 2), np.random.default_rng(1))
    write_recording(
        array / recording_name(1),
        {f"cell_{number}": force * share for number, share in enumerate((0.1, 0.2, 0.3, 0.4), 1)},
    )
    with opened(f"sqlite:///{folder / 'lab.db'}", create=True) as store:
        for campaign in (single, array):
            ingest_folder(store, campaign, jobs=1)
        yield store


def impact_of(session, cells: int) -> tuple[Impact, list]:
    """The first impact whose recording has so many channels of force."""
    for impact in session.scalars(select(Impact).order_by(Impact.id)):
        rows = [
            row for row in list_channels(session, impact.recording_id) if row.quantity == "force"
        ]
        if len(rows) == cells:
            return impact, rows
    raise AssertionError(f"no impact of {cells} cells")


def test_array_of_load_cells_has_its_sum_on_record_and_contact(store):
    with store.reading() as session:
        impact, rows = impact_of(session, 4)
        pulse = session.scalars(
            select(Pulse).where(Pulse.impact_id == impact.id, Pulse.current)
        ).one()
        whole = record_plot(session, rows)
        contact = pulse_plot(session, impact.recording_id, pulse)
        for plot in (whole, contact):
            series = named_series(plot)
            peaks = [series[f"cell_{number}"].y.max() for number in (1, 2, 3, 4)]
            assert series["sum of 4 cells"].y.max() == pytest.approx(sum(peaks), rel=0.01)
            assert plot.y.heading == "force (kN)"
        peak = named_series(contact)["sum of 4 cells"].y.max()
        assert peak == pytest.approx(pulse.peak_force_n / 1e3, rel=0.02)


def test_single_cell_has_no_sum_and_no_peak_of_a_long_record_is_lost(store, monkeypatch):
    monkeypatch.setattr(impact_plot, "_BUCKETS", 50)
    with store.reading() as session:
        impact, (row,) = impact_of(session, 1)
        pulse = session.scalars(
            select(Pulse).where(Pulse.impact_id == impact.id, Pulse.current)
        ).one()
        (line,) = series_of(record_plot(session, [row]))
    assert line.y.size <= 110 < row.samples
    assert line.y.max() >= 0.98 * pulse.peak_force_n / 1e3


def test_record_without_contact_is_drawn_and_an_impact_without_record_is_refused(store):
    with store.writing() as session:
        impact, _ = impact_of(session, 1)
        key = impact.id
        with_contact = impact_figure(session, key)
        session.execute(delete(Pulse).where(Pulse.impact_id == key))
        without_contact = impact_figure(session, key)
        impact.recording_id = None
        session.flush()
        with pytest.raises(LookupError, match=f"impact {key} has no recorded series to draw"):
            impact_figure(session, key)
        session.rollback()
    assert [plot.title for plot in with_contact.plots()] == ["force", "contact"]
    assert [plot.title for plot in without_contact.plots()] == ["force"]
