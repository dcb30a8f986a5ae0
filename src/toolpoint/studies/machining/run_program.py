"""One call: a program over its stock on a machine, from engagement over loads and stability to the table of its blocks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from toolpoint._check import FloatArray, ToolpointError
from toolpoint._doubt import Doubt, doubts_among
from toolpoint.machine import Machine
from toolpoint.material_removal import RemovalSettings, RemovedMaterial, remove_material
from toolpoint.studies.cuts.described_cut import unit_doubts
from toolpoint.studies.cuts.tool_dynamics import ToolDynamics, machine_dynamics
from toolpoint.studies.machining.contacts import contact_doubts, gouge_doubts, question_loads
from toolpoint.studies.machining.engagement_classes import PlaceArcs, arcs_of_places, group_places
from toolpoint.studies.machining.loads import LOAD_COLUMNS, PlaceLoads, largest_of_blocks, place_loads
from toolpoint.studies.machining.margins import Margins, StabilitySolver, place_margins
from toolpoint.studies.machining.program_path import ParsedProgram, ProgramPath, lay_program, travel_doubts
from toolpoint.studies.machining.result import BlockTable, MachiningStudy
from toolpoint.studies.machining.setup import MachiningSetup

POSE_STEP = 0.1  # m: positions of axes within which the dynamics are taken as one pose's
SAMPLED_PLACES = 3000  # at which the arcs are computed at twice the spacing too
NamedProgress = Callable[..., None]


def run_program(program: ParsedProgram, setup: MachiningSetup, dynamics: Machine | ToolDynamics | None = None, *,
                name: str = "program", text: str = "", progress: NamedProgress = lambda name, done, total: None
                ) -> MachiningStudy:
    """Return what every block of a program meets.

    Parameters
    ----------
    program : Program
        As `io.read_program` gives it.
    setup : MachiningSetup
    dynamics : Machine or ToolDynamics, optional
        A machine is posed along the program; without dynamics stability stays unknown.
    name, text : str
        Of the program, for the result.
    progress : function of name, done and total

    Raises ToolpointError for a stock that no cut meets, cuts without spindle speed, tools that are not given.
    """
    laid = lay_program(program, setup, text)
    shapes = [setup.shape_of(number) for number in laid.numbers]
    spacing = setup.spacing_for(shapes)
    removed = remove_material(laid.moves, setup.stock, shapes, RemovalSettings(spacing, setup.slices),
                              holders=[setup.holder_of(number) for number in laid.numbers],
                              progress=lambda done, total: progress("pieces cut", done, total))
    error = _arc_error(removed, laid, setup, spacing)
    loads = place_loads(removed, laid, setup)
    arcs = arcs_of_places(removed)
    margins, classes, notes, doubts = None, 0, list(laid.remarks), list(unit_doubts(setup.cut))
    if dynamics is not None and arcs.place.size:
        poses, known = _poses(dynamics, removed, setup)
        notes += [note for each in known[:1] for note in each.notes]
        groups = group_places(arcs, laid, removed.piece, pose=poses, isotropic=known[0].y == "same")
        classes = groups.count
        margins = place_margins(arcs, groups, laid, removed.piece, solver=StabilitySolver(setup, known), pose=poses,
                                progress=lambda done, total: progress("distinct engagements", done, total))
        doubts += _margin_doubts(margins, arcs)
    if isinstance(dynamics, Machine):
        axes = {axis.name: (axis.lower, axis.upper) for axis in dynamics.chain.axes}
        doubts += travel_doubts(laid.path, axes, dict(setup.zero), setup.stick_out)
    blocks = _blocks(laid, removed, loads, arcs, margins)
    doubts = [*contact_doubts(removed, laid), *gouge_doubts(removed, laid, setup), *question_loads(blocks, removed, laid, setup),
              *doubts, *doubts_among(notes)]
    study = MachiningStudy(name, setup, laid, removed, blocks, tuple(dict.fromkeys(doubts)),
                           tuple(note for note in notes if not isinstance(note, Doubt)), error, classes,
                           0 if margins is None else margins.solutions, tuple(text.splitlines()))
    return replace(study, notes=(*study.notes, *_assumptions(study)))


def _poses(dynamics: Machine | ToolDynamics, removed: RemovedMaterial, setup: MachiningSetup
           ) -> tuple[np.ndarray, Sequence[ToolDynamics]]:
    """Return the pose of every place, and the dynamics of each pose: positions within `POSE_STEP` are one."""
    if isinstance(dynamics, ToolDynamics):
        return np.zeros(removed.piece.size, int), [dynamics]
    letters = [axis.name for axis in dynamics.chain.axes if axis.name in ("X", "Y", "Z") and not axis.is_rotary]
    if not letters:
        return np.zeros(removed.piece.size, int), [machine_dynamics(dynamics, dict(setup.zero))]
    places = np.stack([removed.tip[:, "XYZ".index(name)] + setup.zero.get(name, 0.0) for name in letters], axis=1)
    cells = np.rint(places / POSE_STEP).astype(int)
    cells[removed.reach == 0] = cells[np.argmax(removed.reach > 0)]
    unique, pose = np.unique(cells, axis=0, return_inverse=True)
    known = []
    for k in range(len(unique)):
        mean = places[(pose.reshape(-1) == k) & (removed.reach > 0)].mean(axis=0)
        limits = {axis.name: (axis.lower, axis.upper) for axis in dynamics.chain.axes}
        at = {**setup.zero, **{n: float(np.clip(v, *limits[n])) for n, v in zip(letters, mean, strict=True)}}
        known.append(machine_dynamics(dynamics, at))
    return pose.reshape(-1), known


def _arc_error(removed: RemovedMaterial, laid: ProgramPath, setup: MachiningSetup, spacing: float) -> float:
    """Return by how much arcs at twice the spacing differ from those here, rad: the 95 % point over sampled places."""
    cutting = np.flatnonzero(removed.reach > 0)
    if not cutting.size:
        return 0.0
    chosen = cutting[np.linspace(0, cutting.size - 1, min(SAMPLED_PLACES, cutting.size)).astype(int)]
    sampled = np.zeros(removed.piece.size, bool)
    sampled[chosen] = True
    coarse = remove_material(laid.moves, setup.stock, removed.shapes, RemovalSettings(2 * spacing, setup.slices), sampled=sampled)
    fine_arc, coarse_arc = removed.arc_length[chosen], coarse.arc_length[chosen]
    weight = np.where(removed.reach[chosen] > 0, removed.reach[chosen], 1.0)
    means = [(arc.mean(axis=1) * reach / weight) for arc, reach in ((fine_arc, removed.reach[chosen]), (coarse_arc, coarse.reach[chosen]))]
    return float(np.quantile(np.abs(means[0] - means[1]), 0.95))


def _blocks(laid: ProgramPath, removed: RemovedMaterial, loads: PlaceLoads, arcs: PlaceArcs, margins: Margins | None) -> BlockTable:
    """Return the table of the segments: sums and the largest over their places."""
    n, block = laid.path.count, laid.moves.block[removed.piece]
    volume = np.bincount(laid.moves.block, removed.volume, n)
    depth = np.zeros(removed.piece.size)
    depth[arcs.place] = arcs.depth
    longest = np.nan_to_num(removed.arc_length.max(axis=1, initial=0.0))
    columns = {name: largest_of_blocks(getattr(loads, name), block, n) for name in LOAD_COLUMNS}
    limit, error, frequency, ratio = (np.full(n, np.nan) for _ in range(4))
    cuts = largest_of_blocks(depth, block, n) > 0
    verdict = np.where(cuts, 3, 0)
    worst = np.full(n, -1)
    if margins is not None:
        place_ratio = np.where(margins.stable, np.maximum(margins.limit / arcs.depth, 1.0), np.minimum(margins.limit / arcs.depth, 1.0))
        rank = np.where(np.isnan(margins.limit), np.inf, place_ratio)
        order = np.argsort(-rank, kind="stable")
        of = block[arcs.place[order]]
        worst[of] = order  # the last written has the least ratio
        seen = np.flatnonzero(worst >= 0)
        m = worst[seen]
        limit[seen], error[seen], frequency[seen], ratio[seen] = (margins.limit[m], margins.error[m], margins.frequency[m], place_ratio[m])
        verdict[seen] = np.where(np.isnan(margins.limit[m]), 3, np.where(margins.stable[m], 1, 2))
        depth_at = largest_of_blocks(depth, block, n)
        depth_at[seen] = arcs.depth[m]
    else:
        depth_at = largest_of_blocks(depth, block, n)
    return BlockTable(laid.path.line, volume, depth_at, largest_of_blocks(longest, block, n), columns, limit, error, frequency, ratio,
                      verdict, worst)


def _margin_doubts(margins: Margins, arcs: PlaceArcs) -> list[Doubt]:
    """Return doubts about limits: hulls of arcs, grouping, and cuts that could not be solved."""
    doubts = [Doubt("stability", f"not computed for some engagements: {reason}") for reason in margins.failures[:3]]
    hulls = float(arcs.is_hull.mean()) if arcs.is_hull.size else 0.0
    if hulls > 0.01:
        doubts.append(Doubt("stability", f"at {100 * hulls:.0f} % of the places the arc differs along the axis or is in several pieces; one "
                            "arc over all of them was solved", "look at those blocks in time domain", figure=hulls))
    if margins.grouping > 0.1:
        doubts.append(Doubt("stability", f"grouping engagements changed limits by up to {100 * margins.grouping:.0f} % where blocks were solved "
                            "by themselves", "blocks with more in hand than that are judged well", figure=margins.grouping))
    return doubts


def _assumptions(study: MachiningStudy) -> list[str]:
    """Return what the result rests on."""
    return [f"stock {study.setup.stock.words}; dexels of {1e3 * study.removed.settings.spacing:.3g} mm, {study.removed.settings.slices} slices of "
            "the tool; rapids go straight",
            "forces are those of a rigid tool without run-out; a flat end that plunges has edge forces of its sides alone",
            f"stability at the real depth, in groups of 4° of the arc and 15° of the feed; positions within {1e3 * POSE_STEP:g} mm are one pose"]
