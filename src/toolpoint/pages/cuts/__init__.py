"""Pages of cuts: stability, simulation, forces, tools joined to a spindle."""
