"""Views: plain functions from a project's files to what a page shows, each with its answer, doubts, command and Python call."""
