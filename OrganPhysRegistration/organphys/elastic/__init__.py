"""Floor 6: elastic registration in the reduced basis."""
