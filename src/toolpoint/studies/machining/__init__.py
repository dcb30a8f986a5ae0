"""NC programs on a machine, block by block: engagement, loads, stability, and what to change."""
