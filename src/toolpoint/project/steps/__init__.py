"""Steps of a project: plain functions from files to files, each with its doubts; what a command does, by name."""
