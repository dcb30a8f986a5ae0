"""Measured targets, their noise, and the lines that inform a fit."""
