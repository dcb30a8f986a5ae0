"""The literature's cutting coefficients as a table."""

from __future__ import annotations

from toolpoint.cutting.force.materials import literature, materials
from toolpoint.studies.text_table import text_table


def materials_table() -> str:
    """Return the literature table of cutting coefficients as text: every set, and its source.

    Examples
    --------
    >>> "Kt N/mm^2" in materials_table()
    True
    """
    rows = []
    for name in materials():
        material = literature(name)
        for number, k in enumerate(material.sets, start=1):
            values = [k.kt / 1e6, k.kn / 1e6, k.ka / 1e6, k.edge_t / 1e3, k.edge_n / 1e3, k.edge_a / 1e3]
            rows.append([f"{name}:{number}", *(f"{v:g}" if v else "" for v in values), ""])
        rows += [[f"{name}:{number}", f"{law.kc / 1e6:g}", "", "", "", "", "", f"{law.mc:g}"]
                 for number, law in enumerate(material.kienzle, start=1)]
    header = ["material:set", "Kt N/mm^2", "Kn", "Ka", "Kte N/mm", "Kne", "Kae", "exponent"]
    sources = dict.fromkeys(literature(name).source for name in materials())
    return "\n".join([
        text_table("Cutting coefficients of the literature", header, rows), *(f"source: {source}" for source in sources),
        "Sets with an exponent are Kienzle's law (Kt at 1 mm chip thickness), tangential force only: give `kn` and `feed` with "
        "them."])
