"""What a training searched and found, for the registry: settings as parameters, histories as metrics by step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

#: A setting as MLflow keeps it: text and truth values as parameters, numbers as parameters and figures.
SettingValue = str | bool | int | float


@dataclass(frozen=True)
class FitReport:
    """`settings` that were searched or learned, by name ("kernel", "noise", "layers", "regularisation").

    `by_predictor` are numbers of which there is one for each predictor ("lengthscale"), in the predictors' order.
    `histories` are values by step ("loss", "search_error"), the first step first. Numbers are of standardised columns
    where the name does not say otherwise.
    """

    settings: Mapping[str, SettingValue] = field(default_factory=dict)
    by_predictor: Mapping[str, Sequence[float]] = field(default_factory=dict)
    histories: Mapping[str, Sequence[float]] = field(default_factory=dict)

    def under(self, prefix: str) -> FitReport:
        """The same with every name below `prefix` ("force.kernel")."""
        return FitReport(
            {f"{prefix}.{name}": value for name, value in self.settings.items()},
            {f"{prefix}.{name}": values for name, values in self.by_predictor.items()},
            {f"{prefix}.{name}": values for name, values in self.histories.items()},
        )

    def joined(self, other: FitReport) -> FitReport:
        """Both; where both have a name, that of `other` counts."""
        return FitReport(
            {**self.settings, **other.settings},
            {**self.by_predictor, **other.by_predictor},
            {**self.histories, **other.histories},
        )

    def parameters(self, predictors: Sequence[str]) -> dict[str, SettingValue]:
        """All settings by name, those of each predictor below theirs ("force.lengthscale.tip_radius").

        Raises `ValueError` where a setting has another number of values than there are predictors.
        """
        parameters = dict(self.settings)
        for name, values in self.by_predictor.items():
            if len(values) != len(predictors):
                raise ValueError(f"{name!r} has {len(values)} values for {len(predictors)} predictors")
            pairs = zip(predictors, values, strict=True)
            parameters |= {f"{name}.{predictor}": float(value) for predictor, value in pairs}
        return parameters
