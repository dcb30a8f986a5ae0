"""Pages of NC programs on a machine."""
