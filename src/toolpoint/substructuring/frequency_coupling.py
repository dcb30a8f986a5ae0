r"""Frequency-based coupling and decoupling: from measured or computed receptances of parts to those of the whole, and back.

:math:`Y' = Y - Y B^T (B Y B^T + C)^{-1} B Y`, Y the parts' receptances side by side, B the signed links, C the compliance
of the links. A part is taken away by coupling its negative. Sources: de Klerk, Rixen, Voormeeren, AIAA J. 46 (2008);
Voormeeren, Rixen, Mech. Syst. Signal Process. 27 (2012) (dual decoupling).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from toolpoint._check import ComplexArray, FloatArray, fail, floats
from toolpoint._deprecation import rename_argument
from toolpoint.substructuring.parts import Link, label_of, link_rows, stack_responses
from toolpoint.vibration import Dof, Frf
from toolpoint.vibration.dof import dofs

MAX_INTERFACE_CONDITION = 1e12  # condition number of the interface above which no digit is left
COUPLING_REFINEMENTS = 3  # corrections of the interface forces by their residual
MAX_LONG_ENTRIES = 2**19  # entries that are held in extended precision at once


def couple_responses(parts: Mapping[str, Frf], links: Iterable[Link], *, compliance: ComplexArray | FloatArray | float = 0.0,
                     generator: np.random.Generator | None = None, draws: int = 100) -> Frf:
    """Couple parts by their receptances; the result is labelled ``part.point:direction``.

    Parameters
    ----------
    parts : mapping of name to Frf
        On the same lines; every linked label both an output and an input of its part.
    links : pairs of labels that move together, equal and opposite forces between them
    compliance : number, (n_links,) or (n_f, n_links, n_links), optional
        Of the links; zero joins rigidly.
    generator : numpy Generator, optional
        With it, and where all parts state a variance, the variance of the whole is that of so many `draws`.

    Raises
    ------
    ToolpointError
        For unknown labels, other lines, or an interface that the responses leave singular.

    Examples
    --------
    Two springs side by side are twice as stiff:

    >>> import numpy as np
    >>> from toolpoint.vibration import Frf
    >>> spring = Frf([10.0], np.full((1, 1, 1), 1e-6), ["end:+x"], ["end:+x"])
    >>> both = couple_responses({"a": spring, "b": spring}, [("a.end:+x", "b.end:+x")])
    >>> print(f"{both.values[0, 0, 0].real:.6g} m/N")
    5e-07 m/N
    """
    uncoupled = stack_responses(parts)
    pairs = list(links)
    rows, columns = link_rows(pairs, uncoupled.outputs), link_rows(pairs, uncoupled.inputs, "links (forces)")
    link_compliance = _compliance(compliance, len(pairs), uncoupled.frequency.size)
    values = _couple_to_last_digits(uncoupled.values, rows, columns, link_compliance)
    variance = None
    if generator is not None and uncoupled.variance is not None:
        variance = _draw_variance(uncoupled, rows, columns, link_compliance, generator=generator, draws=draws)
    return replace(uncoupled, values=values, variance=variance, draws=None)


@rename_argument("whole", "assembly", since="0.2")
@rename_argument("beside", "internal_outputs", since="0.2")
def decouple_responses(assembly: Frf, part: Frf, shared: Iterable[Dof | str], *,
                       internal_outputs: Iterable[Dof | str] = ()) -> Frf:
    """Take a part away from an assembly by its receptances: the part is joined once more, with its receptances negated.

    Parameters
    ----------
    assembly, part : Frf
        On the same lines, one label for one place in both.
    shared : labels
        Where the part is joined: outputs and inputs of both.
    internal_outputs : labels, optional
        Other outputs of the part that were measured in the whole too: motion is then compared at all of them, in the
        least-squares sense, while forces act at the shared ones (non-collocated; it tames noise).

    Raises
    ------
    ToolpointError
        For unknown labels, other lines, or an interface that the responses leave singular.

    Examples
    --------
    One of two equal springs side by side is left when the other is taken away:

    >>> import numpy as np
    >>> from toolpoint.vibration import Frf
    >>> both, spring = (Frf([10.0], np.full((1, 1, 1), value), ["end:+x"], ["end:+x"]) for value in (0.5e-6, 1e-6))
    >>> print(f"{decouple_responses(both, spring, ['end:+x']).values[0, 0, 0].real:.6g} m/N")
    1e-06 m/N
    """
    labels, internal = dofs(shared), dofs(internal_outputs)
    uncoupled = stack_responses({"rest": assembly, "part": part})
    split = len(assembly.outputs), len(assembly.inputs)
    values = uncoupled.values.copy()
    values[:, split[0]:, split[1]:] *= -1
    links = [(label_of("rest", label), label_of("part", label)) for label in labels]
    compared = [*links, *((label_of("rest", label), label_of("part", label)) for label in internal)]
    rows, columns = link_rows(compared, uncoupled.outputs), link_rows(links, uncoupled.inputs, "shared (forces)")
    rigid = np.zeros((1, len(compared), len(links)), complex)
    # More motions than forces are a least-squares problem of measured data: its digits are not those of the arithmetic.
    left = (_couple_values if internal else _couple_to_last_digits)(values, rows, columns, rigid)[:, :split[0], :split[1]]
    notes = tuple(dict.fromkeys((*assembly.notes, *part.notes)))
    return Frf(uncoupled.frequency, left, assembly.outputs, assembly.inputs, "receptance", notes=notes)


def _compliance(value: ComplexArray | FloatArray | float, links: int, lines: int) -> ComplexArray:
    array = np.asarray(value, complex)
    if array.ndim == 3:
        if array.shape != (lines, links, links):
            fail("compliance", f"shape {array.shape}", f"must be ({lines}, {links}, {links})")
        return array
    floats("compliance", np.abs(array))
    return np.diag(np.broadcast_to(array, links))[None]


def _couple_values(values: ComplexArray, rows: FloatArray, columns: FloatArray, compliance: ComplexArray) -> ComplexArray:
    """Return Y - Y B_f^T (B Y B_f^T + C)^-1 B Y, (..., n_f, n_outputs, n_inputs); leading axes before the lines are draws.

    Interface rows are scaled to one size first: metres and radians must not decide the rank.
    """
    scaled, left, right = _scale_interface(rows @ values @ columns.T + compliance)
    moved = (rows @ values) / left[..., None]
    solved = np.linalg.solve(scaled, moved) if len(rows) == len(columns) else np.linalg.pinv(scaled) @ moved
    return values - (values @ columns.T) @ (solved / right[..., None])


def _couple_to_last_digits(values: ComplexArray, rows: FloatArray, columns: FloatArray,
                           compliance: ComplexArray) -> ComplexArray:
    """Couple one set of responses as `_couple_values` does, each entry to its last digits where extended precision exists (not
    on Windows, nor on most ARM processors).

    Where one part at the interface moves far more than the other (a resonance of it alone, the more so the less it loses),
    large responses leave small ones, and taking the part away needs these digits: sums and differences are of long numbers, the
    inverse is refined by its residual.
    """
    long_rows, long_columns = rows.astype(np.longdouble), columns.astype(np.longdouble)
    result = np.empty_like(values)
    lines = max(1, MAX_LONG_ENTRIES // max(1, values[0].size))
    for first in range(0, len(values), lines):
        part = slice(first, first + lines)
        exact = values[part].astype(np.clongdouble)
        moved, driven = long_rows @ exact, exact @ long_columns.T
        interface = moved @ long_columns.T + (compliance if len(compliance) == 1 else compliance[part])
        # Translations (1e-8 m/N) and rotations (1e-5 rad/N m) stand side by side: unscaled, the condition would be that of
        # units.
        scaled, left, right = _scale_interface(interface.astype(complex))
        inverse = np.linalg.inv(scaled) / (right[..., :, None] * left[..., None, :])
        solved = (inverse @ moved.astype(complex)).astype(np.clongdouble)
        # Stiff interfaces subtract receptances that are nearly alike: the residual in extended precision gives the lost
        # digits back.
        for _ in range(COUPLING_REFINEMENTS):
            solved = solved + inverse @ (moved - interface @ solved).astype(complex)
        result[part] = exact - driven @ solved
    return result


def _scale_interface(interface: ComplexArray) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Scale an interface matrix to rows and columns of largest entry 1; return it and both sizes. A singular one is refused."""
    left = np.sqrt(np.maximum(np.abs(interface).max(axis=-1), 1e-300))
    right = np.sqrt(np.maximum(np.abs(interface).max(axis=-2), 1e-300))
    scaled = interface / (left[..., :, None] * right[..., None, :])
    singular = np.linalg.svd(scaled, compute_uv=False)
    # An interface of zeros has no size to compare with.
    condition = np.where(singular[..., 0] > 0, singular[..., 0] / np.maximum(singular[..., -1], 1e-300), np.inf)
    if not (condition < MAX_INTERFACE_CONDITION).all():
        fail("links", f"an interface of condition {float(condition.max()):.2g} at some line",
             f"must be below {MAX_INTERFACE_CONDITION:.0e}",
             remedy="leave out labels that follow from others, or lines at which the parts do not answer")
    return scaled, left, right


def _draw_variance(uncoupled: Frf, rows: FloatArray, columns: FloatArray, compliance: ComplexArray,
                   *, generator: np.random.Generator, draws: int) -> FloatArray:
    """Return the variance of the coupled responses over random draws of the parts' noise, (n_f, n_outputs, n_inputs)."""
    assert uncoupled.variance is not None
    # Running sums: no draw is stored.
    total, square = np.zeros_like(uncoupled.values), np.zeros(uncoupled.values.shape)
    for _ in range(draws):
        noise = generator.normal(size=uncoupled.values.shape) + 1j * generator.normal(size=uncoupled.values.shape)
        values = _couple_values(uncoupled.values + np.sqrt(uncoupled.variance / 2) * noise, rows, columns, compliance)
        total += values
        square += np.abs(values) ** 2
    return np.maximum(square / draws - np.abs(total / draws) ** 2, 0.0)
