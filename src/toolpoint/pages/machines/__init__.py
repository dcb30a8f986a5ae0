"""Pages of machines: modes, responses, maps over the workspace, sensitivities."""
