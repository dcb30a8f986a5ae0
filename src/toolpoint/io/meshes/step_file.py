"""STEP files: the unit that they state, and their mesh of 10-node tetrahedra by Netgen (extra `mesh`), kept by content."""

from __future__ import annotations

import hashlib
import importlib.util
import json
import os
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from toolpoint._check import FloatArray, IndexArray, ToolpointError
from toolpoint.io.door import door
from toolpoint.machine.parts.body_store import cache_folder

SUFFIXES = (".step", ".stp")
_PREFIXES = {"": 1.0, "MILLI": 1e-3, "CENTI": 1e-2, "DECI": 1e-1, "MICRO": 1e-6, "KILO": 1e3}
_NAMES = {1.0: "m", 1e-3: "mm", 1e-2: "cm", 0.0254: "in"}
_METRES_OF_INCH_UNIT = {"INCH": 0.0254, "INCHES": 0.0254, "FOOT": 0.3048}
# A part that takes longer is meshed too finely or does not end: the mesher has no bound of its own.
MAX_MESHING_SECONDS = 3600.0
MILLIMETRE = 1e-3  # OpenCASCADE gives millimetres, whatever the file's unit


@dataclass(frozen=True, eq=False)
class StepGeometry:
    """The one solid of a STEP file, m: its volume, centre and corners, and its inertia about the centre (of unit
    density, m^5).

    stated : the length unit of the file, m; digest : of the file's content.
    """

    path: Path
    volume: float
    centre: FloatArray
    low: FloatArray
    high: FloatArray
    inertia: FloatArray
    stated: float
    digest: str

    @property
    def largest(self) -> float:
        """Largest extent, m."""
        return float((self.high - self.low).max())

    def scaled(self, factor: float) -> StepGeometry:
        """Return the geometry in another unit."""
        return replace(self, volume=self.volume * factor**3, centre=self.centre * factor, low=self.low * factor,
                       high=self.high * factor, inertia=self.inertia * factor**5)


@dataclass(frozen=True, eq=False)
class StepMesh:
    """Nodes (n, 3), m, and elements (e, 10) of a STEP solid, and who meshed it."""

    nodes: FloatArray
    elements: IndexArray
    mesher: str


def unit_name(unit: float) -> str:
    """Return ``mm`` for 1e-3 and so on."""
    return next((name for size, name in _NAMES.items() if abs(size / unit - 1) < 1e-9), f"{unit:g} m")


@door("STEP file")
def file_unit(path: Path) -> float:
    """Return the length unit that a STEP file states, m. Raises ToolpointError where it states none, or several."""
    text = re.sub(r"\s+", "", path.read_text(encoding="latin-1")).upper()
    if not text.startswith("ISO-10303-21;"):
        raise ToolpointError(f"{path}: no STEP file (it does not begin with ISO-10303-21); export it again")
    units: set[float] = set()
    for entity in re.findall(r"=\(?([^;]*LENGTH_UNIT\(\)[^;]*);", text):
        metric = re.search(r"SI_UNIT\((?:\$|\.(\w+)\.),\.METRE\.\)", entity)
        other = re.search(r"CONVERSION_BASED_UNIT\('(\w+)'", entity)
        if metric and (metric[1] or "") in _PREFIXES:
            units.add(_PREFIXES[metric[1] or ""])
        elif other and other[1] in _METRES_OF_INCH_UNIT:
            units.add(_METRES_OF_INCH_UNIT[other[1]])
    # An inch is defined by a length in mm, which stands in the file beside it.
    inches = units & set(_METRES_OF_INCH_UNIT.values())
    units = inches or units
    if len(units) != 1:
        what = "no length unit" if not units else "lengths in " + " and ".join(unit_name(u) for u in sorted(units))
        raise ToolpointError(f"{path}: states {what}; must state one; export it again with one unit")
    return units.pop()


def measure_step(path: Path) -> StepGeometry:
    """Return the geometry of a STEP file in the unit that it states."""
    stated = file_unit(path)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    content = _asked(path, None, digest)
    return StepGeometry(path, float(content["volume"]), content["centre"], content["low"], content["high"],
                        content["inertia"], stated, digest).scaled(MILLIMETRE)


def mesh_step(geometry: StepGeometry, mesh_size: float, *, factor: float = 1.0) -> StepMesh:
    """Return the mesh with elements of at most `mesh_size` (m); a mesh made before of the same content is taken from disk.

    factor : of all lengths, for a file whose stated unit is wrong.
    """
    content = _asked(geometry.path, mesh_size / factor / MILLIMETRE, geometry.digest)
    return StepMesh(content["nodes"] * factor * MILLIMETRE, content["elements"], str(content["mesher"]))


def _asked(path: Path, size: float | None, digest: str) -> dict[str, np.ndarray]:
    """Return the answer of the mesher, kept on disk by the content of file and program."""
    script = Path(__file__).with_name("step_mesher.py")
    key = hashlib.sha256(f"{digest} {size!r} {script.read_text(encoding='utf-8')}".encode()).hexdigest()[:32]
    kept = cache_folder() / f"mesh-{key}.npz"
    content = _kept(kept)
    return _answered(path, size, kept, script=script) if content is None else content


def _kept(path: Path) -> dict[str, np.ndarray] | None:
    try:
        with np.load(path, allow_pickle=False) as data:
            return {name: data[name] for name in data.files}
    except (OSError, ValueError, KeyError):
        return None


def _answered(path: Path, size: float | None, kept: Path, *, script: Path) -> dict[str, np.ndarray]:
    """Return what the mesher says to a size in mm, and keep it."""
    if importlib.util.find_spec("netgen") is None:
        raise ToolpointError(f"{path}: meshing a STEP file needs Netgen; install it with: pip install 'toolpoint[mesh]'")
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "mesh.npz"
        request = json.dumps({"path": str(path.resolve()), "size": size, "result": str(result)})
        try:
            process = subprocess.run([sys.executable, "-P", str(script)], input=request + "\n", text=True, capture_output=True,
                                  timeout=MAX_MESHING_SECONDS, check=False)
        except subprocess.TimeoutExpired:
            raise ToolpointError(f"{path}: not meshed within {MAX_MESHING_SECONDS / 60:.0f} minutes; take a larger mesh_size, "
                                 f"or remove "
                                 "small fillets and threads in the CAD program") from None
        content = _kept(result) if process.returncode == 0 else None
        if content is None:
            said = [line[7:] for line in process.stderr.splitlines() if line.startswith("fault: ")]
            reason = said[0] if said else f"the mesher ended with code {process.returncode}"
            if "load OCC geometry" in reason:
                reason = "no whole STEP file; it is damaged or cut off; export it again"
            if "Meshing failed" in reason and size is not None:
                reason = (f"Netgen cannot mesh it with elements of {size:g} mm; take a smaller mesh_size, about as thick as "
                          "its thinnest wall, or heal the solid in the program that drew it")
            raise ToolpointError(f"{path}: {reason}")
        try:
            kept.parent.mkdir(parents=True, exist_ok=True)
            part = kept.with_suffix(f".{os.getpid()}.tmp.npz")
            part.write_bytes(result.read_bytes())
            part.replace(kept)
        except OSError:
            pass
    return content
