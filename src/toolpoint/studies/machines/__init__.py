"""Questions about machines: modes, maps, tool-point responses and limits, sensitivities, a virtual hammer test."""
