"""Displacement: where every block or point of the picture is in every frame, with its uncertainty; several methods."""
