"""Labelling: which raw point is which marker."""
