"""Check of a machine file: what was understood, in words, and doubts about its numbers."""
