"""What is understood of a machine file, in words, and what looks odd in it."""
