"""Modes as data of a fit: scales, covariance, and the mixing of shapes by errors of poles."""
