"""Text."""

TASK = SPEEDS = RESULTS = TRIED = ""
