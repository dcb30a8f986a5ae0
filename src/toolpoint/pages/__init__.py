"""Pages: a result of a study turned into one self-contained report, only when it is asked for."""
