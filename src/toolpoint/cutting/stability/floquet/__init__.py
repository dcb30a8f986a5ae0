"""FloquetDeterminant: stability exact in depth from modes, by the phase of a determinant."""
