"""The take's own regression: a hidden marker from the markers that are seen.

One Gaussian process per gap and hidden marker, learnt from the frames of the same take
in which both are known. No hand model, no subject: any marker that others move with.
"""
