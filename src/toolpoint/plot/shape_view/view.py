"""ShapeView: animated shapes on one scene, or on two side by side, as a part of a page."""

from __future__ import annotations

import base64
import html
import re
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from toolpoint._check import ComplexArray, fail
from toolpoint._rounding import number_text
from toolpoint.plot.figures.theme import RAMP
from toolpoint.plot.page.frame import asset, data_block, page
from toolpoint.plot.shape_view.animated_shapes import AnimatedShapes
from toolpoint.plot.shape_view.scene import Scene

SCRIPTS = ("shape_renderer.js", "shape_view.js", "shape_controls.js")
DIFFERENCE_TITLE = "difference"
_MAX_DOTTED_NODES = 3000  # nodes of a wire model that are drawn as dots too


@dataclass(frozen=True, eq=False)
class ShapeView:
    """Shapes that move on a page, drawn by WebGL2.

    On the page, `window.toolpointViews[name]` has showMode(i), setPhase(radians), setAmplitude(factor), play(on),
    setShape({real, imaginary, frequency, damping, label}, pane) and positions(pane), the node positions as drawn.

    Parameters
    ----------
    scene : Scene
    shapes : AnimatedShapes
        Displacements of the scene's nodes.
    name : str
        Name in `window.toolpointViews`: letters, digits, ``_`` and ``-``, the first a letter.
    title : str
        Words over the scene.
    caption : str
        A sentence under the view.
    other : (Scene, AnimatedShapes, title), optional
        Second scene to the right, moved by the same controls; its mode i is shown beside mode i of the first
        (shape pairs of a test and a model).
    difference : AnimatedShapes, optional
        Shapes on the first scene that are drawn in a further pane on the scale of the first: what a test and a model differ by.
    static_range : (low, high, unit), optional
        Nothing moves: the size of the only shape is a value above `low` at each node, coloured from `low` to `high`.

    Raises
    ------
    ToolpointError
        Where shapes and scene have other numbers of nodes, or two sets of shapes other numbers of modes.

    >>> import numpy as np
    >>> nodes = np.array([[0, 0, 0], [0, 0, 1.0]])
    >>> shapes = AnimatedShapes(np.array([80.0]), np.array([0.02]), np.array([[[0, 0, 0], [1e-3, 0, 0]]], complex))
    >>> ShapeView(Scene(nodes, lines=np.array([[0, 1]])), shapes, title="Column").title
    'Column'
    """

    scene: Scene
    shapes: AnimatedShapes
    name: str = "shapes"
    title: str = ""
    caption: str = ""
    other: tuple[Scene, AnimatedShapes, str] | None = None
    difference: AnimatedShapes | None = None
    static_range: tuple[float, float, str] | None = None

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_-]*", self.name):
            fail("ShapeView.name", repr(self.name), "must be letters, digits, _ and -, the first a letter")
        for scene, shapes, title in self.panes:
            if shapes.displacement.shape[1] != scene.nodes.shape[0]:
                fail("ShapeView.shapes", f"{shapes.displacement.shape[1]} nodes for {title or 'the scene'}",
                     f"must be the {scene.nodes.shape[0]} nodes of its scene")
        for _, shapes, _ in self.panes[1:]:
            if shapes.count != self.shapes.count:
                fail("ShapeView.other", f"{shapes.count} modes beside {self.shapes.count}", "must be equally many",
                     remedy="pair the modes first and take shapes.selected([...]) of both")

    @property
    def panes(self) -> tuple[tuple[Scene, AnimatedShapes, str], ...]:
        """The scenes with their shapes and titles: one, two side by side, and their difference."""
        panes = [(self.scene, self.shapes, self.title)]
        panes += [] if self.other is None else [self.other]
        return (*panes, *([] if self.difference is None else [(self.scene, self.difference, DIFFERENCE_TITLE)]))

    def payload(self) -> dict[str, Any]:
        """Return what the page script reads: packed arrays (positions 32-bit, shapes 16-bit of the largest part)."""
        ends = None if self.static_range is None else [*map(number_text, self.static_range[:2]), self.static_range[2],
                                                       self.static_range[1] - self.static_range[0]]
        panes = [_pane_data(*pane) for pane in self.panes]
        if self.difference is not None:
            panes[-1]["like"] = 0  # the pane whose scale it has
        return {"ramp": RAMP, "panes": panes, "still": ends}

    def fragment(self) -> str:
        """Return the HTML of the view without scripts: a figure and its data block."""
        source, notes = f"tp-data-{self.name}", [note for pane in self.panes for note in pane[1].notes]
        words = " ".join([self.caption, *dict.fromkeys(notes)]).strip()
        caption = f"<figcaption>{html.escape(words)}</figcaption>" if words else ""
        return (f'<figure class="tp-figure"><div class="tp-view" data-name="{self.name}" data-source="{source}">'
                f"<noscript>This view needs JavaScript, which is switched off.</noscript></div>{caption}</figure>"
                + data_block(source, self.payload()))

    def html(self) -> str:
        """Return a page of its own with this view only; it asks no host for anything."""
        body = f"<main>{'<h1>' + html.escape(self.title) + '</h1>' if self.title else ''}{self.fragment()}</main>"
        return page(self.title or "Animated shapes", body, [asset(name) for name in ("packed_data.js", *SCRIPTS, "page.js")])

    def _repr_html_(self) -> str:
        return (f'<iframe sandbox="allow-scripts" style="width:100%;height:44rem;border:0" '
                f'srcdoc="{html.escape(self.html())}"></iframe>')

    def __repr__(self) -> str:
        words = " beside ".join(f"{shapes!r} on {scene!r}" for scene, shapes, _ in self.panes)
        return f"ShapeView({self.name!r}, {words})"


def _pane_data(scene: Scene, shapes: AnimatedShapes, title: str) -> dict[str, Any]:
    count = scene.nodes.shape[0]
    # WebGL takes 16-bit indices up to 65 535 nodes, half the size of 32-bit ones.
    has_long_indices = count > 65535
    index = "<u4" if has_long_indices else "<u2"
    assert shapes.has_data is not None and scene.node_body is not None  # filled when made
    return {
        "title": title, "wide": has_long_indices, "bodies": list(scene.body_names),
        "nodes": pack_array(scene.nodes, "<f4"), "triangles": pack_array(scene.triangles, index),
        "lines": pack_array(scene.lines, index), "body": pack_array(scene.node_body, "<u2"),
        "known": pack_array(shapes.has_data, "u1"), "dots": scene.triangles.shape[0] == 0 and count <= _MAX_DOTTED_NODES,
        "shapes": [
            {"label": label, "frequency": float(f), "damping": float(z), **_shape_data(u)}
            for label, f, z, u in zip(shapes.labels, shapes.frequency, shapes.damping_ratio, shapes.displacement)],
    }


def _shape_data(displacement: ComplexArray) -> dict[str, Any]:
    unit = float(max(np.abs(displacement.real).max(), np.abs(displacement.imag).max()))
    real, imaginary = (pack_array(np.rint(part / unit * 32767), "<i2") if unit and np.any(part) else None
                       for part in (displacement.real, displacement.imag))
    return {"unit": unit, "real": real, "imaginary": imaginary}


def pack_array(values: Any, kind: str) -> dict[str, Any]:
    """Return an array as deflated base64, as it is or as differences down its columns, whichever is shorter."""
    array = np.ascontiguousarray(values).astype(kind)
    columns = int(np.prod(array.shape[1:], dtype=int))
    width = array.itemsize
    unsigned = array.reshape(array.shape[0], columns).view(f"<u{width}")
    steps = np.ascontiguousarray(np.diff(unsigned, axis=0, prepend=np.zeros_like(unsigned[:1])).T)
    planes = steps.reshape(-1, 1).view("u1").T.tobytes()  # all low bytes first: they deflate better together
    deflated, deflated_steps = _deflate(array.tobytes()), _deflate(planes)
    shorter = len(deflated_steps) < len(deflated)
    return {"z": base64.b64encode(deflated_steps if shorter else deflated).decode("ascii"), "size": array.nbytes,
            "width": width, "columns": columns if shorter else 0}


def _deflate(data: bytes) -> bytes:
    compressor = zlib.compressobj(9, zlib.DEFLATED, -15)
    return compressor.compress(data) + compressor.flush()


def scripts_of(parts: Sequence[object]) -> tuple[str, ...]:
    """Return the names of the scripts that these parts need."""
    return SCRIPTS if any(isinstance(part, ShapeView) for part in parts) else ()
