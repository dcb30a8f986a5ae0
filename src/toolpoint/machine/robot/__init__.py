"""Robots from their datasheets: the data as published, gear ratios and reducers from them, and the machine that they make."""
