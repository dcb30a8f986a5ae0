"""Records that the compiled simulation reads and writes: tuples of arrays that the compiler takes as they are."""

from __future__ import annotations

from typing import NamedTuple

from toolpoint._check import ComplexArray, FloatArray


class ModalSteps(NamedTuple):
    """Exact step of the modal states z over each of the n steps after which the speed repeats (n is 1 at constant speed).

    z' = decay z + sum over ways of (first F + last F'), F and F' the force at the step's start and end; the displacement of
    a way is 2 Re(sum of left z). left : (d, modes) complex; decay : (n, modes) complex; first, last : (n, d, modes) complex;
    compliance : (n, d, d) displacement at the step's end by the force there, m/N; length : (n,) s. d is 2 or 3.
    """

    left: ComplexArray
    decay: ComplexArray
    first: ComplexArray
    last: ComplexArray
    compliance: FloatArray
    length: FloatArray


class EdgeElements(NamedTuple):
    """Edge elements, n of all teeth and slices.

    lag : (n,) angle behind tooth 0, rad; share : (n,) length along the edge's meridian, m; outward, upward : (n,) sine and
    cosine of the axial immersion angle; radius : (n,) over the cutter's; entry, leave : (n,) arc of cut, rad; delay, extra :
    (n, memory) steps back to every remembered passage, and the static chip it leaves beside feed (run-out), m.
    """

    lag: FloatArray
    share: FloatArray
    outward: FloatArray
    upward: FloatArray
    radius: FloatArray
    entry: FloatArray
    leave: FloatArray
    delay: FloatArray
    extra: FloatArray


class ElementForces(NamedTuple):
    """Cutting force of an element: coefficients (tangential, normal, axial) of chip, Pa, and of edge, N/m.

    damping : (n,) process damping per metre over cutting speed, for each of the n steps of `ModalSteps`; friction : its share
    along the tangent; linear : edges outside the material stay in contact; exponent : m of a total-energy law, whose forces
    follow h (h/1 mm)^-m in place of the chip h, 0 for the linear-edge law.
    """

    cutting: tuple[float, float, float]
    edge: tuple[float, float, float]
    damping: FloatArray
    friction: float
    linear: bool
    exponent: float = 0.0


class Rotation(NamedTuple):
    """Rotation and feed of the tool.

    first, steps : the step that is known already, and the last one; repeat : steps of a revolution; start, step : angle at
    step 0 and of a step, rad; feed : in m per step at constant speed; fed : feed in m at every step of a varied speed
    (empty at constant speed), the first of them as many steps before the start as there are more than `steps` + 1.
    """

    first: int
    steps: int
    repeat: int
    start: float
    step: float
    feed: float
    fed: FloatArray


class Trace(NamedTuple):
    """Time histories of a simulation: displacement (steps + 1, d) m, force (steps + 1, 3) N, torque over radius (steps + 1,) N,
    and the largest chip thickness (steps + 1,) m."""

    displacement: FloatArray
    force: FloatArray
    torque: FloatArray
    chip: FloatArray
