"""Pages of robots and of changes to machines: datasheet, places, accuracy, screening."""
