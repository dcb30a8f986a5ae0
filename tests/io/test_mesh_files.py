"""Mesh files: one body written by hand in three formats is one model; units, bodies and damaged files."""

import numpy as np
import pytest

from solid_models import brick, tetrahedral_brick
from toolpoint import ToolpointError
from toolpoint.bodies.solid import STEEL
from toolpoint.io import read_mesh
from toolpoint.io.meshes.mesh_content import NASTRAN_HEXAHEDRON


def write_inp(path, model):
    kind = {20: "C3D20R", 10: "C3D10"}[model.blocks[0].nodes.shape[1]]
    lines = ["*HEADING", "** a comment", "*NODE, NSET=ALL"]
    lines += [f"{i + 11}, " + ", ".join(f"{1e3 * x!r}" for x in map(float, p)) for i, p in enumerate(model.nodes)]
    lines.append(f"*ELEMENT, TYPE={kind}, ELSET=column")
    for e, nodes in enumerate(model.blocks[0].nodes):
        words = [str(n) for n in (e + 1, *(nodes + 11))]
        lines += [", ".join(words[:15]) + ",", ", ".join(words[15:])] if len(words) > 16 else [", ".join(words)]
    path.write_text("\n".join([*lines, "*NSET, NSET=FOOT, GENERATE", "11, 13, 1", ""]))


def write_nastran(path, model):
    lines = ["BEGIN BULK"]
    for i, p in enumerate(model.nodes):
        xyz = [f"{1e3 * x:16.9E}" for x in p]
        lines += [f"GRID*   {i + 11:16d}{'':16s}{xyz[0]}{xyz[1]}", f"*       {xyz[2]}"]
    back = np.argsort(NASTRAN_HEXAHEDRON)
    for e, nodes in enumerate(model.blocks[0].nodes):
        order = nodes[back] if len(nodes) == 20 else nodes
        words = [f"{w:8d}" for w in (e + 1, 1, *(order + 11))]
        name = "CHEXA   " if len(nodes) == 20 else "CTETRA  "
        lines += [(name if k == 0 else " " * 8) + "".join(words[k:k + 8]) for k in range(0, len(words), 8)]
    path.write_text("\n".join([*lines, "ENDDATA", ""]))


def write_cdb(path, model):
    lines = ["/PREP7", f"NBLOCK,6,SOLID,{len(model.nodes)}", "(3i9,6e21.13e3)"]
    lines += [f"{i + 11:9d}{0:9d}{0:9d}" + "".join(f"{1e3 * x:21.13E}" for x in p) for i, p in enumerate(model.nodes)]
    lines += ["N,R5.3,LOC,       -1,", "EBLOCK,19,SOLID", "(19i9)"]
    for e, nodes in enumerate(model.blocks[0].nodes):
        words = [f"{w:9d}" for w in (1, 1, 1, 1, 0, 0, 0, 0, len(nodes), 0, e + 1, *(nodes + 11))]
        lines += ["".join(words[:19])] + (["".join(words[19:])] if len(words) > 19 else [])
    path.write_text("\n".join([*lines, "       -1", "CMBLOCK,FOOT,NODE,2", "(8i10)", f"{11:10d}{-13:10d}", ""]))


WRITERS = {".inp": write_inp, ".bdf": write_nastran, ".cdb": write_cdb}


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize("build", [brick, tetrahedral_brick])
def test_a_mesh_is_the_model_it_was_written_from(tmp_path, suffix, build):
    model = build([0.3, 0.2, 0.5], [2, 1, 2])
    path = tmp_path / ("a" + suffix)
    WRITERS[suffix](path, model)
    back = read_mesh(path, STEEL, unit="mm")
    assert np.allclose(back.nodes, model.nodes, atol=1e-10) and (back.blocks[0].nodes == model.blocks[0].nodes).all()
    assert back.mass_properties.mass == pytest.approx(0.03 * STEEL.density, rel=1e-9)
    if suffix != ".bdf":
        assert back.node_sets["FOOT"].tolist() == [0, 1, 2]
    with pytest.raises(ToolpointError, match=r"size: 500 m; .*read it with unit='mm'"):
        read_mesh(path, STEEL, unit="m")


@pytest.mark.parametrize("suffix", WRITERS)
def test_twenty_damaged_meshes(tmp_path, suffix):
    path = tmp_path / ("a" + suffix)
    WRITERS[suffix](path, brick([0.3, 0.2, 0.5], [2, 1, 2]))
    raw, rng, refused = path.read_bytes(), np.random.default_rng(3), 0
    for turn in range(20):
        at = int(rng.integers(30, len(raw) - 60))
        path.write_bytes(raw[:at] if turn < 12 else raw[:at] + bytes(rng.integers(33, 126, 30, dtype=np.uint8)) + raw[at + 30:])
        refused += refuses(path)
    assert refused >= 15


def refuses(path):
    try:
        read_mesh(path, STEEL, unit="mm").stiffness()
    except ToolpointError:
        return True
    return False


