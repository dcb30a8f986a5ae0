"""Programs and records of controllers: G-code, command streams, Sinumerik traces."""
