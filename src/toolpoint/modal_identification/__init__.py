"""Modal identification: frequency responses in, modes with their confidence out; one file a method."""

from toolpoint.modal_identification.identification import Identification
from toolpoint.modal_identification.identify import METHODS, PolyReference, identify
from toolpoint.modal_identification.quadrature import quadrature

__all__ = ["METHODS", "Identification", "PolyReference", "identify", "quadrature"]
