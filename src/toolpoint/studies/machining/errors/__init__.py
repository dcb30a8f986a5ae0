"""Errors of blocks: servo under the cutting force, walls of forced vibration, feed marks."""
