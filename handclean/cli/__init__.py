"""Commands: parse, call one step, print one line."""
