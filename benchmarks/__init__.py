"""Measurements of accuracy, quality and cost."""
