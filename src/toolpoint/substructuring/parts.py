"""Parts side by side before they are joined: labels that carry the part's name, and links between labels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from toolpoint._check import FloatArray, ToolpointError, fail
from toolpoint.vibration import Dof, Frf, SecondOrderSystem
from toolpoint.vibration.dof import dofs, positions

Link = tuple["Dof | str", "Dof | str"]


def label_of(part: str, dof: Dof) -> Dof:
    """Return the label of a part's Dof in the whole: ``part.point:direction``."""
    return replace(dof, point=f"{part}.{dof.point}")


def join_labels(labels: Mapping[str, Sequence[Dof]]) -> tuple[Dof, ...]:
    """Return the labels of all parts in their order."""
    return tuple(label_of(name, dof) for name, part in labels.items() for dof in part)


def link_rows(links: Iterable[Link], labels: Sequence[Dof], name: str = "links") -> FloatArray:
    """Return the signed Boolean matrix of compatibility, one row a link: first minus second is zero, (n_links, n_labels).

    Directions of a link are compared as they are labelled, each along its own; both must be of one kind.
    """
    pairs = [dofs(link) for link in links]
    if not pairs:
        fail(name, "none", "must be at least one pair of labels", remedy="for example ('spindle.nose:+x', 'holder.flange:+x')")
    rows = np.zeros((len(pairs), len(labels)))
    for row, (first, second) in enumerate(pairs):
        if first.is_rotation != second.is_rotation:
            fail(name, f"{first} with {second}", "must be two deflections or two rotations")
        columns = positions(name, (first, second), labels)
        if columns[0] == columns[1]:
            fail(name, f"{first} with itself", "must join two labels")
        rows[row, columns[0]], rows[row, columns[1]] = 1.0, -1.0
    if np.linalg.matrix_rank(rows) < len(rows):
        fail(name, f"{len(rows)} links of rank {np.linalg.matrix_rank(rows)}", "must not repeat each other",
             remedy="leave out links that follow from others")
    return rows


def stack_systems(parts: Mapping[str, SecondOrderSystem]) -> SecondOrderSystem:
    """Stack systems of one pose into one block-diagonal system without links."""
    if not parts:
        fail("parts", "none", "must be at least one")
    for name, part in parts.items():
        if part.poses:
            raise ToolpointError(f"parts.{name}: a batch of poses {part.poses}; must be one pose (system.at_pose(i))")
    systems = list(parts.values())

    def blocks(field: str) -> FloatArray | None:
        if all(getattr(s, field) is None for s in systems):
            return None
        return block_diag(*[np.zeros_like(s.mass) if getattr(s, field) is None else getattr(s, field) for s in systems])

    mass, stiffness = blocks("mass"), blocks("stiffness")
    assert mass is not None and stiffness is not None
    return SecondOrderSystem(
        mass, stiffness, blocks("damping"), blocks("structural_damping"),
        block_diag(*[s.output_map for s in systems]), block_diag(*[s.input_map for s in systems]),
        join_labels({n: s.outputs for n, s in parts.items()}), join_labels({n: s.inputs for n, s in parts.items()}),
        tuple(f"{n}.{c}" for n, s in parts.items() for c in s.coordinates),
        tuple(dict.fromkeys(note for s in systems for note in s.notes)))


def stack_responses(parts: Mapping[str, Frf]) -> Frf:
    """Stack receptances of parts on the same lines into one block-diagonal Frf; variances stay where all parts state them."""
    if not parts:
        fail("parts", "none", "must be at least one")
    frfs = {name: frf.converted_to("receptance") for name, frf in parts.items()}
    first = next(iter(frfs.values()))
    for name, frf in frfs.items():
        if frf.values.ndim != 3:
            raise ToolpointError(f"parts.{name}: a batch of poses; must be one pose")
        if frf.frequency.shape != first.frequency.shape or not np.allclose(frf.frequency, first.frequency, rtol=1e-9):
            raise ToolpointError(f"parts.{name}: other frequency lines ({frf!r} beside {first!r}); interpolate it first: "
                                 "frf.interpolated(frequency)")
    values = _stack_diagonally([frf.values for frf in frfs.values()])
    have_variance = all(frf.variance is not None for frf in frfs.values())
    variance = _stack_diagonally([frf.variance for frf in frfs.values()
                                  if frf.variance is not None]).real if have_variance else None
    return Frf(first.frequency, values, join_labels({n: f.outputs for n, f in frfs.items()}),
               join_labels({n: f.inputs for n, f in frfs.items()}), "receptance", variance=variance,
               notes=tuple(dict.fromkeys(note for frf in frfs.values() for note in frf.notes)))


def _stack_diagonally(blocks: Sequence[np.ndarray]) -> np.ndarray:
    """Return the block-diagonal matrix of every line, (n_f, sum of rows, sum of columns)."""
    rows, columns = sum(b.shape[1] for b in blocks), sum(b.shape[2] for b in blocks)
    result, row, column = np.zeros((len(blocks[0]), rows, columns), complex), 0, 0
    for block in blocks:
        result[:, row:row + block.shape[1], column:column + block.shape[2]] = block
        row, column = row + block.shape[1], column + block.shape[2]
    return result
