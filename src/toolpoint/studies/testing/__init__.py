"""Modal tests and tap tests: plans, verdicts on results, and what to strike again."""
