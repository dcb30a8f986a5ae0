"""Pages of tests as a whole: a tap test, a test plan."""
