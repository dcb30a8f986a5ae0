"""Files of a test: its description, its plan, and the poles that a person chose."""
