"""Modal identification: frequency responses in, modes with their confidence out; one file a method."""

from toolpoint.modal_identification.circle_fit import CircleFit, Quadrature
from toolpoint.modal_identification.complexity import (
    complexity_factor,
    mean_phase_deviation,
    phase_collinearity,
    real_modes,
)
from toolpoint.modal_identification.era import Realization
from toolpoint.modal_identification.identification import Identification
from toolpoint.modal_identification.identify import METHODS, PolyReference, identify
from toolpoint.modal_identification.indicators import Indicator, cmif, mvmif
from toolpoint.modal_identification.lsce import ComplexExponential
from toolpoint.modal_identification.lscf import CommonDenominator
from toolpoint.modal_identification.quadrature import quadrature
from toolpoint.modal_identification.rational_fraction import RationalFraction
from toolpoint.modal_identification.relative_motion import Significance, significance
from toolpoint.modal_identification.residues import Residues, residues
from toolpoint.modal_identification.resonances import Resonance
from toolpoint.modal_identification.stabilization import Diagram

__all__ = [
    "METHODS", "CircleFit", "CommonDenominator", "ComplexExponential", "Diagram", "Identification", "Indicator",
    "PolyReference", "Quadrature", "RationalFraction", "Realization", "Residues", "Resonance", "Significance", "cmif",
    "complexity_factor", "identify", "mean_phase_deviation", "mvmif", "phase_collinearity", "quadrature", "real_modes",
    "residues", "significance"]
