"""A record of the machine against the program that was computed: alignment, blocks, coefficient, chatter."""
