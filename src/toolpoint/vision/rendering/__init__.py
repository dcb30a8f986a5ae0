"""A virtual camera: clips of moving textured bodies whose motion is known exactly."""
