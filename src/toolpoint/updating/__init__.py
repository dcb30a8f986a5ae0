"""Model updating: parameters, residuals, identifiability and fits; the model is a callable, and no machine is known here."""

from toolpoint.updating.fits.fit import fit
from toolpoint.updating.fits.fit_methods import Bayesian, LeastSquares, Regularised
from toolpoint.updating.fits.multi_start import MultiStart, multi_start
from toolpoint.updating.fits.parameter_fit import ParameterFit
from toolpoint.updating.fits.restart import fit_with_restarts
from toolpoint.updating.identifiability import Identifiability, identifiability
from toolpoint.updating.measured.targets import Targets
from toolpoint.updating.models.prediction import Prediction
from toolpoint.updating.models.system_model import AffineSystem, SystemModel
from toolpoint.updating.parameter import Parameter
from toolpoint.updating.problem import Problem

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
