"""One step per command; see ``handclean.pipeline.outcome``."""
