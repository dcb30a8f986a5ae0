"""Projects: one folder from records to advice, whose steps are run again only where what they rest on has changed."""
