"""One way in for every noun of a test: responses, records, modes, geometry, their labels and units; and their ways out."""
