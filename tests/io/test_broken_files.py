"""Files that crash, hang or grow in a reader end in a ToolpointError within seconds, and the process lives."""

import os
import time
import zlib
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from toolpoint._check import ToolpointError
from toolpoint.io import uff
from toolpoint.io.binary import hdf5
from toolpoint.io.measured import frf_files, geometry_files, mode_files, record_files
from toolpoint.io.meshes import stl
from toolpoint.io.servo_data import sinumerik
from toolpoint.io.yaml import component_file, drive_file, machine_file
from toolpoint.vibration import Frf

SECONDS = 5.0
YAML = [machine_file.read, drive_file.read, component_file.read]
UNIVERSAL = [uff.read_frf, uff.read_modes, uff.read_record, uff.read_geometry, uff.headers]
BROKEN = [("segv.mat", [frf_files.read, record_files.read]), ("hang.h5", [frf_files.read, record_files.read, mode_files.read]),
          ("bomb.yaml", [*YAML, geometry_files.read]), ("deep.yaml", YAML), ("huge_integer.yaml", YAML),
          ("bad_uff4_88", UNIVERSAL), ("bad_uff4_5132", UNIVERSAL), ("bad_sinumerik0_13780", [sinumerik.read]),
          ("bad_sinumerik0_4173", [sinumerik.read])]


def refused(reader, path):
    """The words of the refusal; a reader may also read what is left whole."""
    start, spent = time.perf_counter(), time.process_time()
    words = ""
    try:
        reader(path)
    except ToolpointError as error:
        words = str(error)
        assert path.name in words
    # A loaded machine is slow, not wrong: seconds of this process count, and the waiting for another one is bounded.
    assert time.process_time() - spent < SECONDS
    assert time.perf_counter() - start < 12 * SECONDS
    return words


@pytest.mark.parametrize(("name", "readers"), BROKEN)
def test_files_that_broke_a_reader(measured, name, readers):
    words = [refused(reader, measured / "broken" / name) for reader in readers]
    assert any(words)


def test_a_file_that_takes_the_process_down_leaves_the_next_one_readable(measured, tmp_path):
    frf = Frf(np.arange(1.0, 9.0), np.ones((8, 1, 1), complex), ("1:+x",), ("1:+x",))
    hdf5.write(frf, tmp_path / "good.h5")
    for name in ("hang.h5", "segv.mat"):
        assert refused(frf_files.read, measured / "broken" / name)
        np.testing.assert_array_equal(frf_files.read(tmp_path / "good.h5").values, frf.values)


def bomb(path, levels=9, each=10):
    """YAML of aliases in aliases: each**levels entries written out."""
    lines = ["a0: &a0 [" + ",".join("x" * each) + "]"]
    lines += [f"a{i}: &a{i} [" + ",".join([f"*a{i - 1}"] * each) + "]" for i in range(1, levels)]
    path.write_text("toolpoint: 1\n" + "\n".join(lines))


@pytest.mark.parametrize("reader", YAML)
def test_yaml_that_expands_nests_or_counts_without_end(tmp_path, reader):
    bomb(tmp_path / "bomb.yaml")
    assert "aliases" in refused(reader, tmp_path / "bomb.yaml")
    (tmp_path / "deep.yaml").write_text("toolpoint: 1\na: " + "[" * 5000 + "]" * 5000)
    assert "nested" in refused(reader, tmp_path / "deep.yaml")
    (tmp_path / "digits.yaml").write_text("toolpoint: " + "7" * 400)
    assert "digits" in refused(reader, tmp_path / "digits.yaml")


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="no device files here")
def test_devices_and_pipes_are_no_files(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    for path in (Path("/dev/zero"), tmp_path / "pipe"):
        for reader in (stl.read, frf_files.read, record_files.read, geometry_files.read, uff.read_frf, sinumerik.read, *YAML):
            assert "device" in refused(reader, path)


def test_an_array_that_claims_more_than_its_file_holds(tmp_path):
    path = tmp_path / "claims.h5"
    with h5py.File(path, "w") as file:
        file.attrs["format"], file.attrs["version"] = "toolpoint", 1
        group = file.create_group("nouns/noun")
        group.attrs["noun"] = "Frf"
        group.create_dataset("values", shape=(1 << 32,), dtype=float, chunks=(1024,))
    assert "larger than the file" in refused(frf_files.read, path)


def test_compressed_matlab_data_that_are_no_zlib_stream(tmp_path):
    path = tmp_path / "packed.mat"
    savemat(path, {"f": np.arange(9.0), "h": np.ones(9) * 1j}, do_compression=True)
    raw = bytearray(path.read_bytes())
    raw[140:150] = bytes(10)
    path.write_bytes(raw)
    with pytest.raises(zlib.error):
        zlib.decompress(bytes(raw[136:]))
    assert refused(frf_files.read, path)
