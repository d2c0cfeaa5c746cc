"""Parts of the Slicer module OrganPhysSimulation."""
