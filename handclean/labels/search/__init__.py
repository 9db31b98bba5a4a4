"""A target found in a frame without knowing where it was before."""
