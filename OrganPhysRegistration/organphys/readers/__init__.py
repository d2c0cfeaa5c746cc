"""Floor 2: files to point sets; the only place that knows LPS."""
