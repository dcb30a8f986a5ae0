"""Cuts in time: regeneration with loss of contact, and material as a grid of pixels."""
