"""What every method is given, and what it hands back."""
