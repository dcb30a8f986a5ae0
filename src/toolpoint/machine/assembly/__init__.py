"""Parts at poses -> equations: mass, stiffness, damping, preload, spin, and what follows from them."""
