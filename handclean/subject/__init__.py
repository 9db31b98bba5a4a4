"""Calibration of a subject: bone lengths, axes and marker places."""
