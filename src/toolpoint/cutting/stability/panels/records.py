"""Records that the compiled kernels of PanelArnoldi read and write. Panels p, nodes i of all panels, directions d, modes m."""

from __future__ import annotations

from typing import NamedTuple

from toolpoint._check import Array, FloatArray


class Walls(NamedTuple):
    """Envelope of the tool, m, and the walls of the work that its edges cut between, rad at the full radius."""

    corner: float
    radius: float
    entry: float
    leave: float


class EdgeLines(NamedTuple):
    """Edges of the teeth: lag of tooth j at height z (m) is start + slope z, its delay behind the tooth before it tip_delay +
    delay_slope z, rad; `spread`: delays change with height; `marks`: edge lengths where pieces of integration end, m."""

    start: FloatArray
    slope: FloatArray
    tip_delay: FloatArray
    delay_slope: FloatArray
    spread: bool
    marks: FloatArray


class EdgeLaw(NamedTuple):
    """Cutting coefficients (tangential, normal, axial), Pa, and the friction share of process damping."""

    material: FloatArray
    friction: float


class LaidCut(NamedTuple):
    """The cut at every node: own force and damping (i, d, d) and, from first[i] on, the entries of delayed vibration: matrix
    (entries, d, d) and the angle looked back, rad."""

    now: FloatArray
    drag: FloatArray
    first: Array
    matrix: FloatArray
    entry_delay: FloatArray


class PanelNodes(NamedTuple):
    """Panels of one period, rad: ends (p + 1,), where the nodes of each begin and how many they are, Gauss nodes in -1 .. 1 and
    their barycentric weights (i,)."""

    period: float
    ends: FloatArray
    offset: Array
    number: Array
    gauss: FloatArray
    barycentric: FloatArray


class LookBack(NamedTuple):
    """Source of every entry of delayed vibration: the panel, whether that is of the period before, and its interpolation
    row."""

    source: Array
    past: Array
    rows: FloatArray


class Layout(NamedTuple):
    """A cut laid over panels: their nodes, which of them cut, forces at the nodes, and entries with where they look back to."""

    offset: Array
    number: Array
    cutting: Array
    now: FloatArray
    drag: FloatArray
    first: Array
    matrix: FloatArray
    source: Array
    past: Array
    rows: FloatArray


class PanelTimes(NamedTuple):
    """Begin and end of every panel, s; time of every node, s, and half its panel's length times seconds a radian; integration
    matrices by kind (number of nodes) and the kind of every panel; Legendre polynomials at the nodes of a kind (row k: P_k);
    is_uniform: whether time is proportional to the angle (no speed variation)."""

    begin: FloatArray
    end: FloatArray
    time: FloatArray
    half: FloatArray
    rising: FloatArray
    kinds: Array
    legendre: FloatArray
    is_uniform: bool


class ModalWaves(NamedTuple):
    """Closed-form responses of every panel, by kind of input.

    displacement, velocity : (p, nodes d, nodes d) at its nodes to the force there; free, free_velocity : (p, nodes d, 2 m) to
    the state at its start; push : (p, 2 m, nodes d) of the state at its end to the force; step : (p, m) complex, of the state
    itself. Real and imaginary parts stand beside each other in a row of free, below each other in push.
    """

    displacement: FloatArray
    velocity: FloatArray
    free: Array
    free_velocity: Array
    push: FloatArray
    step: Array


class PeriodOperator(NamedTuple):
    """All that maps one period on the next: factor of the laid cut, layout, responses, the panels' inverses, whether damped."""

    depth: float
    layout: Layout
    waves: ModalWaves
    solved: FloatArray
    damped: bool
