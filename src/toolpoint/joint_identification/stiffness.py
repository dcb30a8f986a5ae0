from __future__ import annotations
from dataclasses import dataclass
@dataclass
class MassProperties:
    mass: float
def stiffnesses(*a): raise NotImplementedError
