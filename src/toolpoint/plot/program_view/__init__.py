"""A program in space on a page: path by time, coloured by a chosen quantity, its text, and the lobes of a block."""
