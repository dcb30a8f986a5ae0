"""What is cut and with what: tool, engagement, coefficients, the dynamics in the cutting plane, and the problem they make."""
