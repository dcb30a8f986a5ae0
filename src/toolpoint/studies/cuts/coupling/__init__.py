"""Inside of receptance coupling: the gauge test questioned, lines taken together, peaks between them."""
