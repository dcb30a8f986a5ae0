"""Mechanics of an axis: motor, screw, rack, table, and the plant that they and the structure make."""
