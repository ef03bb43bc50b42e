"""The window: a Processing-style sketch that shows the tracer's pictures."""
