"""The nouns that every measurement and every model ends in, and the verbs between them."""

from toolpoint.vibration.dof import Dof
from toolpoint.vibration.frf import Frf
from toolpoint.vibration.modes import Modes
from toolpoint.vibration.record import Record
from toolpoint.vibration.state_space import StateSpace
from toolpoint.vibration.system import SecondOrderSystem

__all__ = ["Dof", "Frf", "Modes", "Record", "SecondOrderSystem", "StateSpace"]
