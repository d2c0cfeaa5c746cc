"""Floor 5: skinning weights and the reduced deformation basis."""
