"""Methods that find poles, each a small object with one call; diagrams, and the selection among their poles."""
