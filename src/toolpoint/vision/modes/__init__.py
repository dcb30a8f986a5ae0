"""Modes from displacement: free decays for the poles, shapes of points, of the whole picture and of bodies."""
