"""Drift: a later test beside a baseline, whether the machine has changed, and which part of it."""
