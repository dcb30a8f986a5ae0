"""Scripts and style sheets of the pages; no Python."""
