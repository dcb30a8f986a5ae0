"""Modal tests planned and judged as a whole: what is struck, what comes of it, what to strike again."""
