"""Methods of fitting, the searches around them, and what a fit leaves open."""
