"""Refinement of all poles at once with residues and terms outside the band, and their covariance."""
