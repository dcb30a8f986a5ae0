"""Modes as data of a fit: scales, covariance, and what their errors mix."""
