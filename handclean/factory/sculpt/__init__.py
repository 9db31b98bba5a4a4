"""The template hand's skin, modelled by code."""
