"""Engine of a project: steps with named inputs, keys by content, results as ordinary files, a record of every step."""
