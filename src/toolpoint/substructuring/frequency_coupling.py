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
from toolpoint.substructuring.parts import Link, label_of, link_rows, set_responses_apart
from toolpoint.vibration import Dof, Frf
from toolpoint.vibration.dof import dofs

WORST = 1e12  # condition of the interface above which no digit is left
REFINEMENTS = 3
LONG_ENTRIES = 2**19  # that are held as long numbers at once


def couple_responses(parts: Mapping[str, Frf], links: Iterable[Link], *, compliance: ComplexArray | FloatArray | float = 0.0,
                     generator: np.random.Generator | None = None, draws: int = 100) -> Frf:
    """Return the receptances of the whole, labelled ``part.point:direction``.

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
    """
    apart = set_responses_apart(parts)
    pairs = list(links)
    rows, columns = link_rows(pairs, apart.outputs), link_rows(pairs, apart.inputs, "links (forces)")
    soft = _compliance(compliance, len(pairs), apart.frequency.size)
    values = _refined(apart.values, rows, columns, soft)
    variance = None
    if generator is not None and apart.variance is not None:
        variance = _spread(apart, rows, columns, soft, generator=generator, draws=draws)
    return replace(apart, values=values, variance=variance)


def decouple_responses(whole: Frf, part: Frf, shared: Iterable[Dof | str], *, beside: Iterable[Dof | str] = ()) -> Frf:
    """Return the receptances of what is left of a whole when a part is taken away: the part joined once more, negative.

    Parameters
    ----------
    whole, part : Frf
        On the same lines, one label for one place in both.
    shared : labels
        Where the part is joined: outputs and inputs of both.
    beside : labels, optional
        Other outputs of the part that were measured in the whole too: motion is then compared at all of them, in the
        least-squares sense, while forces act at the shared ones (non-collocated; it tames noise).
    """
    labels, more = dofs(shared), dofs(beside)
    apart = set_responses_apart({"rest": whole, "part": part})
    split = len(whole.outputs), len(whole.inputs)
    values = apart.values.copy()
    values[:, split[0]:, split[1]:] *= -1
    links = [(label_of("rest", label), label_of("part", label)) for label in labels]
    met = [*links, *((label_of("rest", label), label_of("part", label)) for label in more)]
    rows, columns = link_rows(met, apart.outputs), link_rows(links, apart.inputs, "shared (forces)")
    rigid = np.zeros((1, len(met), len(links)), complex)
    # More motions than forces are a least-squares problem of measured data: its digits are not those of the arithmetic.
    left = (_coupled if more else _refined)(values, rows, columns, rigid)[:, :split[0], :split[1]]
    notes = tuple(dict.fromkeys((*whole.notes, *part.notes)))
    return Frf(apart.frequency, left, whole.outputs, whole.inputs, "receptance", notes=notes)


def _compliance(value: ComplexArray | FloatArray | float, links: int, lines: int) -> ComplexArray:
    given = np.asarray(value, complex)
    if given.ndim == 3:
        if given.shape != (lines, links, links):
            fail("compliance", f"shape {given.shape}", f"must be ({lines}, {links}, {links})")
        return given
    floats("compliance", np.abs(given))
    return np.diag(np.broadcast_to(given, links))[None]


def _coupled(values: ComplexArray, rows: FloatArray, columns: FloatArray, compliance: ComplexArray) -> ComplexArray:
    """Return Y - Y B_f^T (B Y B_f^T + C)^-1 B Y; leading axes before the lines are draws.

    Interface rows are scaled to one size first: metres and radians must not decide the rank.
    """
    scaled, left, right = _scaled(rows @ values @ columns.T + compliance)
    moved = (rows @ values) / left[..., None]
    solved = np.linalg.solve(scaled, moved) if len(rows) == len(columns) else np.linalg.pinv(scaled) @ moved
    return values - (values @ columns.T) @ (solved / right[..., None])


def _refined(values: ComplexArray, rows: FloatArray, columns: FloatArray, compliance: ComplexArray) -> ComplexArray:
    """Return what `_coupled` does for one set of responses, every entry to its own last digits where numbers longer than double
    are there (not on Windows, nor on most ARM processors).

    Where one part at the interface moves far more than the other (a resonance of it alone, the more so the less it loses),
    large responses leave small ones, and taking the part away needs these digits: sums and differences are of long numbers, the
    inverse is refined by its residual.
    """
    long_rows, long_columns = rows.astype(np.longdouble), columns.astype(np.longdouble)
    result = np.empty_like(values)
    lines = max(1, LONG_ENTRIES // max(1, values[0].size))
    for first in range(0, len(values), lines):
        part = slice(first, first + lines)
        exact = values[part].astype(np.clongdouble)
        moved, driven = long_rows @ exact, exact @ long_columns.T
        interface = moved @ long_columns.T + (compliance if len(compliance) == 1 else compliance[part])
        scaled, left, right = _scaled(interface.astype(complex))
        inverse = np.linalg.inv(scaled) / (right[..., :, None] * left[..., None, :])
        solved = (inverse @ moved.astype(complex)).astype(np.clongdouble)
        for _ in range(REFINEMENTS):
            solved = solved + inverse @ (moved - interface @ solved).astype(complex)
        result[part] = exact - driven @ solved
    return result


def _scaled(interface: ComplexArray) -> tuple[ComplexArray, FloatArray, FloatArray]:
    """Return an interface's matrix with rows and columns of one size, and both sizes; one that is singular is refused."""
    left = np.sqrt(np.maximum(np.abs(interface).max(axis=-1), 1e-300))
    right = np.sqrt(np.maximum(np.abs(interface).max(axis=-2), 1e-300))
    scaled = interface / (left[..., :, None] * right[..., None, :])
    singular = np.linalg.svd(scaled, compute_uv=False)
    worst = singular[..., 0] / np.maximum(singular[..., -1], 1e-300)
    if not (worst < WORST).all():
        fail("links", f"an interface of condition {float(worst.max()):.2g} at some line", f"must be below {WORST:.0e}",
             remedy="leave out labels that follow from others, or lines at which the parts do not answer")
    return scaled, left, right


def _spread(apart: Frf, rows: FloatArray, columns: FloatArray, compliance: ComplexArray,
            *, generator: np.random.Generator, draws: int) -> FloatArray:
    assert apart.variance is not None
    total, square = np.zeros_like(apart.values), np.zeros(apart.values.shape)
    for _ in range(draws):
        noise = generator.normal(size=apart.values.shape) + 1j * generator.normal(size=apart.values.shape)
        values = _coupled(apart.values + np.sqrt(apart.variance / 2) * noise, rows, columns, compliance)
        total += values
        square += np.abs(values) ** 2
    return np.maximum(square / draws - np.abs(total / draws) ** 2, 0.0)
