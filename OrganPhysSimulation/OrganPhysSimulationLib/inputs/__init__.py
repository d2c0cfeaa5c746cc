"""What the user chose in the scene, as the simulator takes it."""
