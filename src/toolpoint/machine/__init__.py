"""A machine: its description, its parts, and its equations of motion at any pose."""

from toolpoint.machine.assemble import assemble
from toolpoint.machine.build import build
from toolpoint.machine.description import MachineDescription
from toolpoint.machine.model import Machine
from toolpoint.machine.preload import static_equilibrium

__all__ = ["Machine", "MachineDescription", "assemble", "build", "static_equilibrium"]
