"""Stability methods of the literature on the one problem type: frequency domain, time steps, collocation, closed forms."""
