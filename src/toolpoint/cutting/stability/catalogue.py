"""METHODS: every stability method by name, as files and the command line write it."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from toolpoint._check import one_of
from toolpoint.cutting.stability.automatic import Automatic
from toolpoint.cutting.stability.floquet.method import FloquetDeterminant
from toolpoint.cutting.stability.hill.method import HillDeterminant
from toolpoint.cutting.stability.method import StabilityMethod
from toolpoint.cutting.stability.methods.collocation import Collocation
from toolpoint.cutting.stability.methods.discretization import FullDiscretization, SemiDiscretization
from toolpoint.cutting.stability.methods.multi_frequency import MultiFrequency
from toolpoint.cutting.stability.methods.zero_order import ZeroOrder
from toolpoint.cutting.stability.panels.method import PanelArnoldi

_METHOD_CLASSES: tuple[type[StabilityMethod], ...] = (
    Automatic, FloquetDeterminant, PanelArnoldi, HillDeterminant, ZeroOrder, MultiFrequency, SemiDiscretization,
    FullDiscretization, Collocation)
METHODS: Mapping[str, type[StabilityMethod]] = MappingProxyType({method.name: method for method in _METHOD_CLASSES})

# The field's words for the classes that charts name as their method.
WORDS_OF_METHODS: Mapping[str, str] = MappingProxyType({
    "FloquetDeterminant": "the Floquet determinant", "PanelArnoldi": "panels of one period (Arnoldi)",
    "HillDeterminant": "Hill's determinant", "ZeroOrder": "the zero-order (single-frequency) solution",
    "MultiFrequency": "the multi-frequency solution", "SemiDiscretization": "semi-discretization",
    "FullDiscretization": "full discretization", "Collocation": "collocation"})


def method_words(method: str) -> str:
    """Return the method of a chart in words for a reader, its settings behind it.

    >>> method_words("FloquetDeterminant"), method_words("MultiFrequency(harmonics=3)")
    ('the Floquet determinant', 'the multi-frequency solution (harmonics=3)')
    """
    name, bracket, settings = method.partition("(")
    return WORDS_OF_METHODS.get(name, name) + (f" ({settings}" if bracket else "")


def method_named(name: str, argument: str = "method") -> StabilityMethod:
    """Return the method of this name with its own defaults; `argument` is named in the error, which lists all methods.

    Examples
    --------
    >>> from toolpoint.cutting import stability
    >>> stability.method_named("zero-order")
    ZeroOrder(lines=1500)
    """
    return METHODS[one_of(argument, name, METHODS)]()
