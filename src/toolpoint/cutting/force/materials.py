"""Cutting coefficients from the literature: ranges with their sources, never one number alone."""

from __future__ import annotations

from dataclasses import dataclass

from toolpoint._check import fail, suggestion
from toolpoint._notebook import NotebookText
from toolpoint.cutting.cut.coefficients import CuttingCoefficients
from toolpoint.cutting.force.laws import Kienzle

_CJME = "table 5 of Chin. J. Mech. Eng. 34 (2021), 10.1186/s10033-021-00536-9"
_VDI = "VDI 3323 groups, an insert maker's user guide"

# material: (Ktc, Krc, Kac in N/mm^2, Kte, Kre, Kae in N/mm); None is not given by the source
_EDGE: dict[str, list[tuple[float | None, ...]]] = {
    "Al 6082-T6": [(631, 99, 273, 13, 10, 2.8)],
    "Al 7075": [(767.0, 168.8, 222, 27.7, 26.6, 0.7), (600.5, 181.0, None, 17.9, 20.4, None),
                (951.4, 262.6, 323.3, 11.1, 11.3, 1.1), (1319.4, 788.8, 48.75, 19.65, 26.77, 2.05)],
    "Al 6061-T6": [(243.8, 113.5, None, 7.5, 7.8, None)],
}
# material: [(kc1.1 in N/mm^2, mc)]
_KIENZLE = {
    "C45": [(1500, 0.22), (1675, 0.24)],
    "42CrMo4 (4140)": [(1775, 0.24), (1675, 0.24), (1725, 0.24)],
    "grey iron": [(1150, 0.20), (1350, 0.28)],
    "nodular iron": [(1225, 0.25), (1350, 0.28)],
    "wrought aluminium": [(700, 0.25), (800, 0.25)],
    "titanium, pure": [(1160, 0.24)],
    "Ti6Al4V": [(1245, 0.24)],
    "nickel superalloy": [(3300, 0.24)],
}


@dataclass(frozen=True)
class Range(NotebookText):
    """Values of one material from one source or several."""

    material: str
    sets: tuple[CuttingCoefficients, ...]
    kienzle: tuple[Kienzle, ...]
    source: str

    @property
    def kt(self) -> tuple[float, float]:
        """Least and largest tangential coefficient, Pa (Kienzle: at 1 mm chip thickness)."""
        values = [c.kt for c in self.sets] + [k.kc for k in self.kienzle]
        return min(values), max(values)

    def __repr__(self) -> str:
        kt_min, kt_max = self.kt
        return f"Range({self.material}: kt {kt_min / 1e6:g}..{kt_max / 1e6:g} N/mm^2, {self.source})"


def materials() -> tuple[str, ...]:
    """Return the names of the materials in the table."""
    return (*_EDGE, *_KIENZLE)


def literature(material: str) -> Range:
    """Return what the literature gives for a material; one alloy spreads by a factor of two between sources.

    Raises ToolpointError for a material that is not in the table, with the nearest name.
    """
    if material in _EDGE:
        sets = []
        for row in _EDGE[material]:
            kt, kn, ka, te, ne, ae = (0.0 if x is None else float(x) for x in row)
            sets.append(CuttingCoefficients(1e6 * kt, 1e6 * kn, 1e6 * ka, 1e3 * te, 1e3 * ne, 1e3 * ae, _CJME))
        return Range(material, tuple(sets), (), _CJME)
    if material in _KIENZLE:
        return Range(material, (), tuple(Kienzle(1e6 * k, m) for k, m in _KIENZLE[material]), _VDI)
    fail("material", repr(material), "must be one of " + ", ".join(materials()), remedy=suggestion(material, materials()))
