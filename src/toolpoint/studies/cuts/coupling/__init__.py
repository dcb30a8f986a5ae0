"""Receptance coupling of tools: doubts about the gauge test, smoothing of lines, peaks between lines."""
