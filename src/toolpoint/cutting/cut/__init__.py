"""Parts of a cut: tool, engagement, coefficients, the dynamics in the cutting plane."""
