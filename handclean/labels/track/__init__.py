"""A target tracked from frame to frame: prediction, assignment, fit, outliers."""
