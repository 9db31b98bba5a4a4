"""handclean: offline cleaning of optical hand motion capture."""

__version__ = "0.1.0"
