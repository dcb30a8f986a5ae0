"""Material removal: stock as dexels, tool shapes, what each move of a program takes away, and the arcs over which it cuts.

Names below are loaded on first use: the kernels bring the compiler.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from toolpoint._exports import export_lazily

if TYPE_CHECKING:
    from toolpoint.material_removal.moves import Moves, split_moves
    from toolpoint.material_removal.removal import remove_material
    from toolpoint.material_removal.removed import RemovalSettings, RemovedMaterial
    from toolpoint.material_removal.stock import Stock
    from toolpoint.material_removal.tool_shape import Holder, MillShape, shape_of_kind

__all__ = ["Holder", "MillShape", "Moves", "RemovalSettings", "RemovedMaterial", "Stock", "remove_material", "shape_of_kind",
           "split_moves"]

__getattr__, __dir__ = export_lazily(__name__, {
    "moves": ("Moves", "split_moves"),
    "removal": ("remove_material",),
    "removed": ("RemovalSettings", "RemovedMaterial"),
    "stock": ("Stock",),
    "tool_shape": ("Holder", "MillShape", "shape_of_kind"),
})
