"""Problem: a model, its parameters and the targets, as residuals and Jacobian over the parameters' coordinates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import Array, FloatArray, fail, one_of
from toolpoint.updating.measured.targets import Targets
from toolpoint.updating.models.prediction import DirectedModel, Prediction, PredictionModel, ShapeSlopes
from toolpoint.updating.parameter import Coordinates, Parameter, check_parameters
from toolpoint.updating.residuals import FREQUENCY_WEIGHT, Residuals, Weighting, join_residuals

SENSITIVITIES = ("exact", "finite differences", "central differences")
# In the coordinates of a fit, which are of order one: rounding (1e-16/step) and curvature (step) are both below 1e-6 of the
# slope in a first difference.
DIFFERENCE_STEP = 1e-6


class Problem:
    """Fit to be made: models, parameters and targets.

    Parameters
    ----------
    model : Model, or a sequence of them
        Callable (values, names) -> Prediction; several for several poses or states of a machine with the same parameters.
    parameters : sequence of Parameter
    targets : Targets, or a sequence of them
        One for each model; several beside one model are several measurements of the same thing. Their errors count as
        independent of each other.
    sensitivities : str
        ``exact`` (the model's own), or ``finite differences`` (forward) or ``central differences`` (for models that
        have none, and for comparison).
    frequency_weight : float
        How much nearness in frequency counts beside MAC when modes are paired, see `residuals.track_modes`.

    >>> from toolpoint.vibration import Modes
    >>> def model(values, names=()):  # a mass of 2 kg on a spring
    ...     return Prediction(Modes([np.sqrt(values["k"] / 2.0) / (2 * np.pi)], [0.01], [[1.0]], ["tool:+x"]))
    >>> problem = Problem(model, [Parameter("k", 8e6, 1e6, 2e7)], Targets(model({"k": 8e6}).modes))
    >>> problem.evaluated(problem.start).values.tolist()  # no misfit where the model is the truth
    [0.0]
    """

    def __init__(
        self, model: PredictionModel | Sequence[PredictionModel], parameters: Sequence[Parameter],
        targets: Targets | Sequence[Targets],
        sensitivities: str = "exact", frequency_weight: float = FREQUENCY_WEIGHT,
    ) -> None:
        self.targets = (targets,) if isinstance(targets, Targets) else tuple(targets)
        self.models: tuple[PredictionModel, ...] = (
            (model,) * len(self.targets) if callable(model) else tuple(model))
        if not self.targets or len(self.models) != len(self.targets):
            fail("targets", f"{len(self.targets)} for {len(self.models)} models", "must be one for each model, at least one")
        self.parameters = check_parameters(parameters)
        self.sensitivities = one_of("sensitivities", sensitivities, SENSITIVITIES)
        self.frequency_weight = frequency_weight
        self.weightings = tuple(Weighting(t, frequency_weight) for t in self.targets)
        self.coordinates = Coordinates(self.parameters)
        self.evaluations = 0
        self._last: tuple[bytes, Residuals] | None = None

    @property
    def model(self) -> PredictionModel:
        """The first model."""
        return self.models[0]

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
        lower, upper = zip(*(p.bounds for p in self.parameters), strict=True)
        return np.array(lower), np.array(upper)

    @property
    def assumed(self) -> bool:
        """Whether any standard deviation in use is an assumption and not the measurement's own."""
        return any(t.assumed for t in self.targets)

    @property
    def measured(self) -> bool:
        """Whether any standard deviation in use is the measurement's own."""
        return any(t.measured for t in self.targets)

    def values(self, x: FloatArray) -> dict[str, float]:
        """Return all numbers of the model at x, links included."""
        return self.coordinates.values(x)

    def predictions(self, x: FloatArray) -> tuple[Prediction, ...]:
        """Return every model's prediction at x, without derivatives."""
        values = self.values(x)
        return self._each(lambda model: model(values, ()))

    def prediction(self, x: FloatArray) -> Prediction:
        """Return the first model's prediction at x, without derivatives."""
        return self.models[0](self.values(x), ())

    def _each(self, call: Callable[[PredictionModel], Prediction]) -> tuple[Prediction, ...]:
        """Return the prediction of every model; one that is there several times is asked once."""
        predictions_by_model: dict[int, Prediction] = {}
        for model in self.models:
            if id(model) not in predictions_by_model:
                predictions_by_model[id(model)] = call(model)
        return tuple(predictions_by_model[id(model)] for model in self.models)

    def evaluated(self, x: FloatArray, slopes: bool = False, columns: Sequence[int] | None = None) -> Residuals:
        """Return the residuals at x; with `slopes` their Jacobian to x of the parameters `columns` (all where
        left out)."""
        if not slopes:
            return self._plain(x)
        columns = tuple(range(len(self.parameters))) if columns is None else tuple(columns)
        if self.sensitivities != "exact":
            return self._differences(x, columns)
        self.evaluations += 1
        values, (names, owner, change) = self.values(x), self.coordinates.directions(x, columns)
        residuals = self._joined(self._each(lambda model: _directed(model, values, names, owner, change)))
        if residuals.jacobian is None:
            raise TypeError("the model returned no derivatives: give them, or use sensitivities='finite differences'")
        return residuals

    def _joined(self, predictions: tuple[Prediction, ...]) -> Residuals:
        return join_residuals([w.residuals(p) for w, p in zip(self.weightings, predictions, strict=True)], predictions)

    def _plain(self, x: FloatArray) -> Residuals:
        key = x.tobytes()
        if self._last is None or self._last[0] != key:
            self.evaluations += 1
            self._last = key, self._joined(self.predictions(x))
        return self._last[1]

    def _differences(self, x: FloatArray, columns: Sequence[int]) -> Residuals:
        residuals = self._plain(x)
        jacobian = np.empty((residuals.values.size, len(columns)))
        upper = self.bounds[1]
        for k, j in enumerate(columns):
            moved = x.copy()
            # Backwards at the upper bound, where a model may not exist beyond.
            moved[j] += DIFFERENCE_STEP if x[j] + DIFFERENCE_STEP <= upper[j] else -DIFFERENCE_STEP
            forward, backward, base = self._plain(moved), residuals, x
            if self.sensitivities == "central differences":
                base = 2 * x - moved
                backward = self._plain(base)
            jacobian[:, k] = (forward.values - backward.values) / (moved[j] - base[j])
        return replace(residuals, jacobian=jacobian)

    def moved_to(self, values: dict[str, float]) -> Problem:
        """Return the problem starting from other values; the priors' means move along."""
        new = [p.moved_to(values.get(p.name, p.value)) for p in self.parameters]
        return Problem(self.models, new, self.targets, self.sensitivities, self.frequency_weight)

    def with_targets(self, targets: Targets | Sequence[Targets]) -> Problem:
        """Return the problem with other targets."""
        return Problem(self.models, self.parameters, targets, self.sensitivities, self.frequency_weight)

    def with_sets(self, sets: Sequence[int]) -> Problem:
        """Return the problem with these sets of targets only."""
        return Problem([self.models[k] for k in sets], self.parameters, [self.targets[k] for k in sets], self.sensitivities,
                       self.frequency_weight)

    def with_pairing(self, frequency_weight: float) -> Problem:
        """Return the problem with another weight of frequency in the pairing of modes."""
        return Problem(self.models, self.parameters, self.targets, self.sensitivities, frequency_weight)

    def __repr__(self) -> str:
        sets = f"{len(self.targets)} sets of targets" if len(self.targets) > 1 else repr(self.targets[0])
        return f"Problem({len(self.parameters)} parameters, {self.sensitivities} sensitivities, {sets})"


def _directed(model: PredictionModel, values: dict[str, float], names: tuple[str, ...], owner: tuple[int, ...],
              change: FloatArray
              ) -> Prediction:
    """Return the prediction with derivatives along the parameters, from those to single numbers where the model has no more."""
    if isinstance(model, DirectedModel):
        return model.along(values, names, owner, slopes=change)
    prediction = model(values, names)
    chain = np.zeros((len(names), max(owner) + 1))
    chain[np.arange(len(names)), list(owner)] = change
    def chained(array: Array | None) -> Array | None:
        return None if array is None else np.tensordot(chain.T, array, 1)

    shape = prediction.shape_slopes
    turned = replace(shape, turns=shape.turns @ chain) if isinstance(shape, ShapeSlopes) else chained(shape)
    return Prediction(prediction.modes, prediction.frf, chained(prediction.frequency_slopes),
                      chained(prediction.damping_slopes), turned, chained(prediction.frf_slopes))
