"""The articulated hand: template, marker sets, and the model the solver moves."""
