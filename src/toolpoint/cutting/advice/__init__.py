"""Advice against chatter: best spindle speeds, and the probability of stability."""
