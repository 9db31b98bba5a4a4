"""Errors against a reference, plots and pages."""
