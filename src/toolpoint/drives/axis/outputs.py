"""Outputs of every axis of a plant, in the order in which the kernel and an exported unit read them."""

from __future__ import annotations

OUTPUTS = ("angle", "speed", "scale", "i_d", "i_q", "table", "tool")
ANGLE, SPEED, SCALE, CURRENT_D, CURRENT_Q, TABLE, TOOL = range(len(OUTPUTS))
