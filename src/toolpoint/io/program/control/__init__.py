"""State of a control that every dialect has: units, planes, frames, tool centre control, drilling cycles."""
