"""Files that the page of the workbench loads."""
