"""Model updating: parameters, residuals, identifiability and fits; the model is a callable, and no machine is known here."""

from toolpoint.updating.fit import fit
from toolpoint.updating.fit_methods import Bayesian, LeastSquares, Regularised
from toolpoint.updating.identifiability import Identifiability, identifiability
from toolpoint.updating.multi_start import MultiStart, multi_start
from toolpoint.updating.parameter import Parameter
from toolpoint.updating.parameter_fit import ParameterFit
from toolpoint.updating.prediction import Prediction
from toolpoint.updating.problem import Problem
from toolpoint.updating.restart import fit_with_restarts
from toolpoint.updating.system_model import AffineSystem, SystemModel
from toolpoint.updating.targets import Targets

__all__ = [
    "AffineSystem",
    "Bayesian",
    "Identifiability",
    "LeastSquares",
    "MultiStart",
    "Parameter",
    "ParameterFit",
    "Prediction",
    "Problem",
    "Regularised",
    "SystemModel",
    "Targets",
    "fit",
    "fit_with_restarts",
    "identifiability",
    "multi_start",
]
