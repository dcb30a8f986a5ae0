"""A small importer of co-simulation units through ctypes: what the test needs of an FMI 2.0 master."""

from __future__ import annotations

import ctypes
import xml.etree.ElementTree as ElementTree
import zipfile
from pathlib import Path

import numpy as np

LOGGER = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)


class Callbacks(ctypes.Structure):
    _fields_ = [("logger", LOGGER), ("allocate", ctypes.c_void_p), ("free", ctypes.c_void_p),
                ("finished", ctypes.c_void_p), ("environment", ctypes.c_void_p)]


class Unit:
    """An unzipped unit, instantiated."""

    def __init__(self, path: Path, folder: Path) -> None:
        with zipfile.ZipFile(path) as file:
            file.extractall(folder)
        self.description = ElementTree.parse(folder / "modelDescription.xml").getroot()
        self.references = {v.get("name"): int(v.get("valueReference")) for v in self.description.iter("ScalarVariable")}
        identifier = self.description.find("CoSimulation").get("modelIdentifier")
        self.library = ctypes.CDLL(str(next((folder / "binaries").rglob(identifier + ".*"))))
        self.messages: list[str] = []
        log = LOGGER(lambda environment, name, status, category, text: self.messages.append(text.decode()))
        self.callbacks = Callbacks(log, None, None, None, None)
        make = self.library.fmi2Instantiate
        make.restype = ctypes.c_void_p
        self.component = ctypes.c_void_p(make(b"test", 1, self.description.get("guid").encode(), b"",
                                              ctypes.byref(self.callbacks), 0, 0))
        assert self.component.value
        self.call("fmi2SetupExperiment", ctypes.c_int(0), ctypes.c_double(0), ctypes.c_double(0), ctypes.c_int(0),
                  ctypes.c_double(0))

    def call(self, name: str, *arguments: object) -> int:
        return getattr(self.library, name)(self.component, *arguments)

    def _places(self, names: list[str]) -> tuple[object, ctypes.c_size_t]:
        return (ctypes.c_uint * len(names))(*(self.references[n] for n in names)), ctypes.c_size_t(len(names))

    def put(self, values: dict[str, float]) -> int:
        return self.call("fmi2SetReal", *self._places(list(values)), (ctypes.c_double * len(values))(*values.values()))

    def get(self, names: list[str]) -> np.ndarray:
        out = (ctypes.c_double * len(names))()
        assert self.call("fmi2GetReal", *self._places(names), out) == 0
        return np.array(out)

    def step(self, time: float, size: float) -> int:
        return self.call("fmi2DoStep", ctypes.c_double(time), ctypes.c_double(size), ctypes.c_int(1))


def followed(unit: Unit, command: object, axes: list[str], outputs: tuple[str, ...]) -> np.ndarray:
    """Return outputs (n, n_axes, n_outputs) at the samples of a command."""
    names = [f"{a}.{o}" for a in axes for o in outputs]
    rows = [unit.get(names)]
    for k in range(command.position.shape[0] - 1):
        for i, a in enumerate(axes):
            unit.put({f"{a}.position": command.position[k, i], f"{a}.velocity": command.velocity[k, i],
                      f"{a}.acceleration": command.acceleration[k, i]})
        assert unit.step(k * command.sample_time, command.sample_time) == 0, unit.messages
        rows.append(unit.get(names))
    return np.array(rows).reshape(-1, len(axes), len(outputs))
