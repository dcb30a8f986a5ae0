"""Questions asked of machines: modes, maps, what the cut sees, sensitivities, a virtual hammer test."""
