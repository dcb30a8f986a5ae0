"""What to do about chatter: best spindle speeds, and the probability of stability."""
