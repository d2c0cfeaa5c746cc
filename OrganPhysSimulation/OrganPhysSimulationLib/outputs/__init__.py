"""Nodes and files that a simulation writes."""
