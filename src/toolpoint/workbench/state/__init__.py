"""State of the workbench on the server: the project's folder, its jobs, the log of events."""
