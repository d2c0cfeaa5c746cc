"""The sections of the module panel: each binds its part of the .ui to the logic."""
