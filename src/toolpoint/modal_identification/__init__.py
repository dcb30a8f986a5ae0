"""Modal identification: frequency responses in, modes with their confidence out; one file a method."""

from toolpoint.modal_identification.identify import METHODS, PolyReference, identify
from toolpoint.modal_identification.judgement.complexity import (
    complexity_factor,
    mean_phase_deviation,
    phase_collinearity,
    real_modes,
)
from toolpoint.modal_identification.judgement.identification import Identification
from toolpoint.modal_identification.judgement.indicators import Indicator, cmif, mvmif
from toolpoint.modal_identification.judgement.relative_motion import Significance, significance
from toolpoint.modal_identification.judgement.resonances import Resonance
from toolpoint.modal_identification.judgement.window import without_window
from toolpoint.modal_identification.operational.band_modes import OPERATIONAL_METHODS, Subspace
from toolpoint.modal_identification.operational.harmonics import Harmonic
from toolpoint.modal_identification.operational.identify import identify_operational
from toolpoint.modal_identification.operational.result import OperationalIdentification
from toolpoint.modal_identification.poles.choice import AddedPole, PoleChoice
from toolpoint.modal_identification.poles.circle_fit import CircleFit, Quadrature
from toolpoint.modal_identification.poles.era import Realization
from toolpoint.modal_identification.poles.lsce import ComplexExponential
from toolpoint.modal_identification.poles.lscf import CommonDenominator
from toolpoint.modal_identification.poles.quadrature import quadrature
from toolpoint.modal_identification.poles.rational_fraction import RationalFraction
from toolpoint.modal_identification.poles.stabilization import Diagram
from toolpoint.modal_identification.residues import Residues, residues

__all__ = [
    "METHODS", "OPERATIONAL_METHODS", "AddedPole", "CircleFit", "CommonDenominator", "ComplexExponential", "Diagram",
    "Harmonic", "Identification", "Indicator", "OperationalIdentification", "PoleChoice", "PolyReference", "Quadrature",
    "RationalFraction", "Realization", "Residues", "Resonance", "Significance", "Subspace", "cmif", "complexity_factor",
    "identify", "identify_operational", "mean_phase_deviation", "mvmif", "phase_collinearity", "quadrature",
    "real_modes", "residues", "significance", "without_window"]
