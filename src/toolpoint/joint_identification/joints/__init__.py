"""One joint at a time: its kind, fit, estimate and stiffness."""
