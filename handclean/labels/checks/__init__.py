"""Can the result be right at all: the unit, the side, the evidence."""
