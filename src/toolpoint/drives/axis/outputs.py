"""Outputs of every axis of a plant, in their order: what the kernel and an exported unit read by name."""

from __future__ import annotations

OUTPUTS = ("angle", "speed", "scale", "i_d", "i_q", "table", "tool")
ANGLE, SPEED, SCALE, CURRENT_D, CURRENT_Q, TABLE, TOOL = range(len(OUTPUTS))
