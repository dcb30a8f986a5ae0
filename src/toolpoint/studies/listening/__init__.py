"""A cut judged by its sound or vibration: chatter or not, at which frequency, of which kind, what speed instead."""
