"""The commands, a module a family: options, one call below, a page."""
