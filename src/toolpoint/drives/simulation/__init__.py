"""Servo simulation: the exact step of the plant, the sampled controllers, histories."""
