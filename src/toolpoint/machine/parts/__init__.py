"""Description -> parts: the machine, its chain, and the bodies of each elastic kind."""
