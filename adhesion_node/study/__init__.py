"""Studies: the papers' figures as commands."""
