"""Vision: video in, displacement, mode shapes and magnified motion out."""
