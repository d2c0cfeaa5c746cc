"""Floor 4: tissue, hyperelastic energies and solvers."""
