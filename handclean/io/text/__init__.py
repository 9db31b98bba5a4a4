"""Takes as text: CSV, TSV, TRC, MOT."""
