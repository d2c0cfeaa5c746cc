"""Results of a registration as MRML nodes, and what is done with them: show, adjust, apply, export, undo."""
