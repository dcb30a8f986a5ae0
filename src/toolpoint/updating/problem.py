"""Problem: a model, its parameters and the targets, as residuals and Jacobian over the parameters' coordinates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from toolpoint._check import FloatArray, one_of
from toolpoint.updating.parameter import Parameter, chain_rule, checked, values_at
from toolpoint.updating.prediction import Model, Prediction
from toolpoint.updating.residuals import FREQUENCY_WEIGHT, Residuals, Weighting
from toolpoint.updating.targets import Targets

SENSITIVITIES = ("exact", "finite differences", "central differences")
_STEP = 1e-6


class Problem:
    """What is to be fitted.

    Parameters
    ----------
    model : Model
        Callable (values, names) -> Prediction.
    parameters : sequence of Parameter
    targets : Targets
    sensitivities : str
        ``exact`` (the model's own), or ``finite differences`` (forward) or ``central differences`` (for models that
        have none, and for comparison).
    frequency_weight : float
        How much nearness in frequency counts beside MAC when modes are paired, see `residuals.tracked`.
    """

    def __init__(
        self, model: Model, parameters: Sequence[Parameter], targets: Targets, sensitivities: str = "exact",
        frequency_weight: float = FREQUENCY_WEIGHT,
    ) -> None:
        self.model, self.parameters, self.targets = model, checked(parameters), targets
        self.sensitivities = one_of("sensitivities", sensitivities, SENSITIVITIES)
        self.weighting = Weighting(targets, frequency_weight)
        self.evaluations = 0

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(p.name for p in self.parameters)

    @property
    def start(self) -> FloatArray:
        """Coordinates of the start, all zero."""
        return np.zeros(len(self.parameters))

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds in x, (n,) each."""
        low, high = zip(*(p.bounds for p in self.parameters), strict=True)
        return np.array(low), np.array(high)

    def prediction(self, x: FloatArray) -> Prediction:
        """Return the model's prediction at x, without derivatives."""
        return self.model(values_at(self.parameters, x), ())

    def evaluated(self, x: FloatArray, slopes: bool = False, at: Sequence[int] | None = None) -> Residuals:
        """Return the residuals at x; with `slopes` their Jacobian to x of the parameters `at` (all where left out)."""
        columns = list(range(len(self.parameters))) if at is None else list(at)
        self.evaluations += 1
        if not slopes:
            return self.weighting.residuals(self.prediction(x))
        if self.sensitivities != "exact":
            return self._differences(x, columns)
        names, chain = chain_rule([self.parameters[j] for j in columns], x[columns])
        found = self.weighting.residuals(self.model(values_at(self.parameters, x), names))
        if found.jacobian is None:
            raise TypeError("the model returned no derivatives: give them, or use sensitivities='finite differences'")
        return Residuals(found.values, found.jacobian @ chain, found.blocks, found.tracking)

    def _differences(self, x: FloatArray, columns: Sequence[int]) -> Residuals:
        here = self.weighting.residuals(self.prediction(x))
        jacobian = np.empty((here.values.size, len(columns)))
        high = self.bounds[1]
        for k, j in enumerate(columns):
            moved = x.copy()
            moved[j] += _STEP if x[j] + _STEP <= high[j] else -_STEP
            self.evaluations += 1
            there = self.weighting.residuals(self.prediction(moved))
            back, base = here, x
            if self.sensitivities == "central differences":
                base = 2 * x - moved
                self.evaluations += 1
                back = self.weighting.residuals(self.prediction(base))
            jacobian[:, k] = (there.values - back.values) / (moved[j] - base[j])
        return Residuals(here.values, jacobian, here.blocks, here.tracking)

    def moved_to(self, values: dict[str, float]) -> Problem:
        """Return the problem starting from other values; the priors' means move along."""
        new = [p.moved_to(values.get(p.name, p.value)) for p in self.parameters]
        return Problem(self.model, new, self.targets, self.sensitivities, self.weighting.frequency_weight)

    def with_targets(self, targets: Targets) -> Problem:
        """Return the problem with other targets."""
        return Problem(self.model, self.parameters, targets, self.sensitivities, self.weighting.frequency_weight)

    def with_pairing(self, frequency_weight: float) -> Problem:
        """Return the problem with another weight of frequency in the pairing of modes."""
        return Problem(self.model, self.parameters, self.targets, self.sensitivities, frequency_weight)

    def __repr__(self) -> str:
        return f"Problem({len(self.parameters)} parameters, {self.sensitivities} sensitivities, {self.targets!r})"
