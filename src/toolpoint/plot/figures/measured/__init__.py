"""Figures of measurements and of models beside them."""
