"""Pages of feed drives and controllers' records."""
