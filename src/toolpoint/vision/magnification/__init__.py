"""Magnification: motion made visible, by the identified shape or by local phase; edges drawn over the machine at rest."""
