"""Predictions of targets by models, with slopes."""
