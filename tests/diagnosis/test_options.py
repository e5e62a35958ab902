"""What may be asked of a diagnosis, and what is refused."""

from __future__ import annotations

import pytest
from pyroshock.diagnosis.options import Options


@pytest.mark.parametrize("name", ["plate.magic", "gnu.friction_coefficient", "friction_coefficient"])
def test_uncertainty_of_no_stage_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=name):
        Options(uncertain={name: 0.1})


def test_uncertainties_go_to_their_stage() -> None:
    options = Options(uncertain={"gun.travel_m": 0.01, "contact.impactor_mass_kg": 0.02})
    assert options.uncertain_of("gun") == {"travel_m": 0.01}
    assert options.uncertain_of("contact") == {"impactor_mass_kg": 0.02}


def test_tolerance_of_no_stage_is_refused() -> None:
    with pytest.raises(ValueError, match="laser"):
        Options(tolerances={"laser": 0.1})
