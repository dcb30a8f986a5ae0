"""Questions about servos: an experiment along a path, margins over the workspace."""
