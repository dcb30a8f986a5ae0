"""Methods that find poles, each a small object with one call; diagrams, and the choice among their poles."""
