"""Predicted pulses as a picture: the band drawn is the one that is stated."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from pyroshock.app.train.contact_model import ContactPulses
from scipy.stats import norm


def test_drawn_band_holds_nine_of_ten_pulses() -> None:
    from matplotlib.figure import Figure

    force_n, spread_n = np.full((1, 20), 4e3), np.full((1, 20), 500.0)
    pulses = ContactPulses("tree@1", force_n, np.array([1e-3]), spread_n, None, ("",), pd.RangeIndex(1))
    axes = pulses.plot(Figure().add_subplot())
    edges_kn = axes.collections[0].get_paths()[0].vertices[:, 1]
    lower, upper = norm.interval(0.9, loc=4.0, scale=0.5)
    assert (edges_kn.min(), edges_kn.max()) == pytest.approx((lower, upper), abs=1e-3)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time since first contact (ms)", "force (kN)")
