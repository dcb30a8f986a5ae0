r"""Receptance coupling of a shaft to a base: from what a spindle does at a plane to what the tool does at its tip.

In a plane of bending the receptance of a section is 2x2, over (deflection, rotation) and (force, moment): H, L = N^T, P.
A base H_b carried through a free shaft with transfer matrix T has, at the tip,
:math:`H = (T_{11} H_b + T_{12}) (T_{21} H_b + T_{22})^{-1}`. Sources: Schmitz, Donaldson, Annals of the CIRP 49/1 (2000);
Park, Altintas, Movahhedy, Int. J. Machine Tools Manuf. 43 (2003).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, complexes, fail, floats, increasing, nonnegative, one_of
from toolpoint._notebook import NotebookText
from toolpoint.substructuring.shaft import ShaftDescription
from toolpoint.vibration import Dof, Frf

# The slope of the deflection along the shaft, from base to tip (-z), as a rotation about the machine's axes.
SLOPES = {"x": "-ry", "y": "+rx"}
DEFAULT_DRAW_COUNT = 200  # equally likely receptances, where the number is left out


@dataclass(frozen=True, eq=False)
class PlaneReceptance(NotebookText):
    """Receptance of one section in one plane of bending, with random draws of its uncertainty.

    Parameters
    ----------
    frequency : (n_f,) floats
        Hz, increasing.
    values : (n_f, 2, 2) complex
        Over deflection (m) and slope along the shaft from base to tip (rad), per force (N) and moment (N m).
    plane : str
        ``x`` or ``y``: the direction of the deflection.
    draws : (n_draws, n_f, 2, 2) complex, optional
        Equally likely values; none where nothing is known of the uncertainty.
    notes : sequence of str

    Examples
    --------
    >>> import numpy as np
    >>> PlaneReceptance(np.array([100.0, 200.0]), np.zeros((2, 2, 2)))
    PlaneReceptance(x, 100..200 Hz, 2 lines)
    """

    frequency: FloatArray
    values: ComplexArray
    plane: str = "x"
    draws: ComplexArray | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        put = object.__setattr__
        put(self, "frequency", nonnegative("frequency", increasing("frequency", floats("frequency", self.frequency))))
        n = self.frequency.size
        put(self, "values", complexes("values", self.values, (n, 2, 2)))
        one_of("plane", self.plane, SLOPES)
        if self.draws is not None:
            put(self, "draws", complexes("draws", self.draws, (None, n, 2, 2)))
        put(self, "notes", tuple(self.notes))

    def band(self, share: float = 0.95) -> tuple[ComplexArray, ComplexArray]:
        """Return lower and upper ends, real and imaginary part each, of the interval that holds the deflection per force with
        probability `share`: quantiles of the draws, shape (n_f,) each. Raises ToolpointError without draws."""
        if self.draws is None:
            fail("band", "no draws", "the uncertainty of the base must be known",
                 remedy="give measured responses with their variance")
        percentages = [50 * (1 - share), 50 * (1 + share)]
        values = self.draws[:, :, 0, 0]
        lower_end, upper_end = _percentiles(values.real, percentages) + 1j * _percentiles(values.imag, percentages)
        return lower_end, upper_end

    def frf(self, point: str = "tool") -> Frf:
        """Return the deflection per force as an Frf; its variance is the scatter of the draws."""
        label = (Dof(point, f"+{self.plane}"),)
        variance = None if self.draws is None else self.draws[:, :, :1, :1].var(axis=0)
        return Frf(self.frequency, self.values[:, :1, :1], label, label, variance=variance, notes=self.notes)

    def __repr__(self) -> str:
        drawn = "" if self.draws is None else f", {len(self.draws)} draws"
        return (f"PlaneReceptance({self.plane}, {self.frequency[0]:g}..{self.frequency[-1]:g} Hz, {self.frequency.size} lines"
                f"{drawn})")


def _percentiles(values: FloatArray, percentages: list[float]) -> FloatArray:
    # Plotting positions k/(n + 1): quantiles by linear interpolation of so few draws are too narrow.
    return np.percentile(values, percentages, axis=0, method="weibull")


def plane_receptance(frf: Frf, point: str, plane: str = "x", *, draws: int = 0,
                     generator: np.random.Generator | None = None) -> PlaneReceptance:
    """Return the 2x2 receptance of a point of an Frf that has deflection and rotation: a computed spindle, an FE model.

    The shaft runs along -z from the point (ISO 841: z away from the work), so its slope is -ry in the plane of x, +rx in
    that of y. With `draws` and a stated variance, equally likely values are drawn from it.

    Raises ToolpointError where rotations or moments are missing: they can be had from a gauge, see `gauge.identify_base`.
    """
    one_of("plane", plane, SLOPES)
    turn = SLOPES[plane]
    labels = [Dof(point, f"+{plane}"), Dof(point, f"+{turn[1:]}")]
    for label in labels:
        if label not in frf.outputs or label not in frf.inputs:
            fail("frf", f"no response and force at {label}", "coupling needs deflections, rotations, forces and moments",
                 remedy="measure a gauge of known size in the spindle in place of the tool and give its responses at two "
                        "stations")
    # Slope and moment change sign together, so that the receptance stays symmetric.
    sign = np.array([1.0, -1.0 if turn[0] == "-" else 1.0])
    part = frf.converted_to("receptance").selected(labels, labels)
    values = sign[:, None] * part.values * sign
    drawn = None
    if draws and part.variance is not None:
        generator = generator or np.random.default_rng(0)
        drawn = values + complex_noise(part.variance, draws, generator)
    return PlaneReceptance(part.frequency, values, plane, drawn, part.notes)


def complex_noise(variance: FloatArray, draws: int, generator: np.random.Generator) -> ComplexArray:
    """Return circular complex normal noise with E|e|^2 = variance, shape (draws, *variance.shape)."""
    shape = (draws, *variance.shape)
    return np.sqrt(variance / 2) * (generator.normal(size=shape) + 1j * generator.normal(size=shape))


def couple_tool(base: PlaneReceptance, shaft: ShaftDescription, *, generator: np.random.Generator | None = None
                ) -> PlaneReceptance:
    """Couple a shaft to a base; return the receptance at its tip.

    Every draw of the base is carried through a shaft drawn within its own deviations. Without draws of the base, the
    deviations of the shaft alone are carried (with `generator`).

    Parameters
    ----------
    base : PlaneReceptance
        Of the section where the shaft begins, without the shaft.
    shaft : ShaftDescription
    generator : numpy Generator, optional
        For the deviations of the shaft; needed where it states any.

    Raises
    ------
    ToolpointError
        For a shaft with deviations without a generator, and a line at an undamped resonance.

    Examples
    --------
    A steel rod of 20 mm x 100 mm on a rigid base, statically: L^3/(3 E I) and the shear deflection.

    >>> import numpy as np
    >>> from toolpoint.substructuring import SegmentDescription, ShaftDescription
    >>> rod = ShaftDescription({"rod": SegmentDescription(length=0.1, diameter=0.02)})
    >>> tip = couple_tool(PlaneReceptance(np.array([0.0]), np.zeros((1, 2, 2))), rod)
    >>> print(f"{1e6 * tip.values[0, 0, 0].real:.4f} um/N")
    0.2065 um/N
    """
    tip, _ = carry(base.frequency, shaft, base.values[:, None])
    is_uncertain = is_uncertain_shaft(shaft)
    if is_uncertain and generator is None:
        fail("generator", "None", "a shaft with deviations needs a numpy Generator to draw them",
             remedy="for example numpy.random.default_rng(1)")
    draws = base.draws
    if draws is None and is_uncertain:
        draws = np.broadcast_to(base.values, (DEFAULT_DRAW_COUNT, *base.values.shape))
    carried = None
    if draws is not None:
        carried = _carry_draws(base.frequency, shaft, draws, generator if is_uncertain else None)
    return replace(base, values=tip[:, 0], draws=carried)


def is_uncertain_shaft(shaft: ShaftDescription) -> bool:
    """Whether a shaft states deviations that change its dynamics."""
    fluted = any(part.fluted for part in shaft.segments.values())
    held = any(part.contact is not None for part in shaft.segments.values())
    return bool(shaft.diameter_deviation or shaft.modulus_deviation or (shaft.equivalent_deviation and fluted)
                or (shaft.contact_deviation and held))


def _carry_draws(frequency: FloatArray, shaft: ShaftDescription, draws: ComplexArray,
                 generator: np.random.Generator | None) -> ComplexArray:
    if generator is None:
        return np.moveaxis(carry(frequency, shaft, np.moveaxis(draws, 0, 1))[0], 1, 0)
    # A shaft of its own for each draw of the base: both uncertainties are independent, and the scatter holds both.
    return np.stack([carry(frequency, shaft.drawn(generator), draw[:, None])[0][:, 0] for draw in draws])


def carry(frequency: FloatArray, shaft: ShaftDescription, base: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Carry base receptances through a shaft; return those of the tip, and the base's wrench per tip wrench, (n_f, m, 2, 2).

    base : (n_f, m, 2, 2), m alternatives a line. A small change dH of the base changes the tip by S^T dH S, S the second
    result.
    """
    from toolpoint.substructuring import segment_kernel

    start = np.array(base, complex, order="C")  # of its own: the kernel would be compiled for read-only ones too
    tip, sway = np.empty_like(start), np.empty_like(start)
    segment_kernel.carry_receptances(2 * np.pi * frequency, shaft.rows, start, tip, sway)
    if not np.isfinite(tip).all():
        line = frequency[int(np.argwhere(~np.isfinite(tip))[0, 0])]
        fail("frequency", f"{line:g} Hz, an undamped resonance", "must not be a line",
             remedy="give base or shaft a loss factor")
    return tip, sway
