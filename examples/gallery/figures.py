"""The table of the gallery: every script, the figure of the thesis that it redraws, and what it is
drawn from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from pyroshock.training.registry.evaluate import Evaluation

from . import (
    chamber_pressure,
    contact_differences,
    cost_by_test,
    cost_function,
    deconvolution,
    exit_velocity,
    extraction_against_truth,
    extraction_methods,
    force_from_plate,
    force_models,
    force_profiles,
    impulse_error_by_test,
    measured_velocities,
    predictor_correlation,
    pulse_from_models,
    resampled_pulses,
    resampling_error,
    safety_plates,
    spectrum_construction,
    trained,
    virtual_campaign,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Scene:
    """What figures are drawn from, made when the first of them asks: a virtual campaign in `work`,
    trained models."""

    work: Path
    hits: int = 5
    models: tuple[str, ...] = trained.QUICK

    @cached_property
    def campaign(self) -> virtual_campaign.HammerCampaign:
        return virtual_campaign.recorded(self.work, self.hits)

    @cached_property
    def judged(self) -> Evaluation:
        return trained.judged(self.campaign.table(), self.models)


@dataclass(frozen=True)
class Entry:
    """The numbers of the thesis's figures, and how they are drawn."""

    thesis: str
    draw: Callable[[Scene], Figure]


#: By the script's name, which is the picture's too.
FIGURES: Mapping[str, Entry] = {
    "spectrum_construction": Entry("1.1", lambda _: spectrum_construction.draw()),
    "force_profiles": Entry("1.7", lambda _: force_profiles.draw()),
    "safety_plates": Entry("2.6, 2.7", lambda _: safety_plates.draw()),
    "force_from_plate": Entry("2.9", lambda scene: force_from_plate.draw(scene.campaign)),
    "exit_velocity": Entry("2.12", lambda _: exit_velocity.draw()),
    "deconvolution": Entry("4.2", lambda scene: deconvolution.draw(scene.campaign)),
    "extraction_methods": Entry("4.3", lambda scene: extraction_methods.draw(scene.campaign)),
    "resampling_error": Entry("4.4", lambda scene: resampling_error.draw(scene.campaign)),
    "resampled_pulses": Entry("4.5", lambda scene: resampled_pulses.draw(scene.campaign)),
    "contact_differences": Entry("4.6", lambda scene: contact_differences.draw(scene.campaign)),
    "extraction_against_truth": Entry(
        "4.7", lambda scene: extraction_against_truth.draw(scene.campaign)
    ),
    "predictor_correlation": Entry("4.8", lambda scene: predictor_correlation.draw(scene.campaign)),
    "pulse_from_models": Entry("4.9", lambda scene: pulse_from_models.draw(scene.judged)),
    "force_models": Entry("4.10", lambda scene: force_models.draw(scene.judged)),
    "chamber_pressure": Entry("5.1", lambda _: chamber_pressure.draw()),
    "measured_velocities": Entry("5.2", lambda _: measured_velocities.draw()),
    "cost_function": Entry("5.3", lambda _: cost_function.draw()),
    "cost_by_test": Entry("5.4", lambda scene: cost_by_test.draw(scene.judged)),
    "impulse_error_by_test": Entry("5.5", lambda scene: impulse_error_by_test.draw(scene.judged)),
}
