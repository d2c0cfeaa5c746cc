"""One thin adapter per method: ``register(problem, clock) -> Outcome``."""
