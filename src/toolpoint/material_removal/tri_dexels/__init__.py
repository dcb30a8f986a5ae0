"""Tri-dexels: stock along x, y and z for tools of any and of changing direction."""
