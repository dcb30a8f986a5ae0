"""Questions asked of machines: how they are run over many points, and the named studies."""
