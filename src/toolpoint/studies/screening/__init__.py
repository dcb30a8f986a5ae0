"""Screening of design changes: designs, metrics, runs that resume, effects with confidence; and what to change."""
