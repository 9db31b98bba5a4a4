"""Mathematics that knows no hand."""
