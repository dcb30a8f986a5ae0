"""Check of a machine file: the machine in words, and doubts about its numbers."""
