"""Figures of NC programs."""

from toolpoint.plot.figures.machining.course import course_over_time, record_over_time

__all__ = ["course_over_time", "record_over_time"]
