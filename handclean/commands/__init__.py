"""One step per command; see ``handclean.runner.outcome``."""
