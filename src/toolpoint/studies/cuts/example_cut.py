"""Published cut that stands in where none is described, with a note on its values in use."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from toolpoint.cutting.description import CuttingDescription

EXAMPLE_CUT = CuttingDescription.of(
    diameter=0.02, teeth=4, immersion=0.5, tangential=767.0e6, normal=168.8e6, speeds=(3000.0, 20000.0),
    source="example: 20 mm end mill, four teeth, half immersion; Al 7075-T6, "
           "Chin. J. Mech. Eng. 2021, 10.1186/s10033-021-00536-9")


def example_cut(stated: Mapping[str, Any]) -> tuple[CuttingDescription, list[str]]:
    """Return the example's cut, and a note on its values that stand in for missing ones."""
    is_slot, has_material = stated.get("direction") == "slot", "material" in stated
    cut = EXAMPLE_CUT
    tool, arc, k = cut.tool, cut.engagement, cut.coefficients
    values = {"diameter": f"diameter {1e3 * tool.diameter:g} mm", "teeth": f"{tool.teeth} teeth",
              "direction": f"direction {arc.direction}", "immersion": f"immersion {arc.immersion:g}",
              "tangential": f"kt {1e-6 * (k.tangential or 0):g} N/mm^2", "normal": f"kn {1e-6 * (k.normal or 0):g} N/mm^2"}
    needless = {"immersion"} if is_slot else {"direction", "immersion"} if "entry" in stated else set()
    needless |= {"tangential", "normal"} if has_material else set()
    taken = [words for name, words in values.items() if name not in stated and name not in needless]
    return cut, [f"Not given and taken from an example: {', '.join(taken)} ({cut.source})."] if taken else []
