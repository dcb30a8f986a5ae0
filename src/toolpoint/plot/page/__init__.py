"""The frame of a page and its parts."""
