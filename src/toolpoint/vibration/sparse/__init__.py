"""Large sparse symmetric matrices: one factorisation for all uses, and modes by shift-invert Lanczos with a count."""

from toolpoint.vibration.sparse.eigenpairs import EigenPairs
from toolpoint.vibration.sparse.factorisation import Factorisation, factorise
from toolpoint.vibration.sparse.lanczos import count_below, modes

__all__ = ["EigenPairs", "Factorisation", "count_below", "factorise", "modes"]
