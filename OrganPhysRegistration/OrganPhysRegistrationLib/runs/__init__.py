"""Registration in a child process: the process, what goes in and comes out, and the run as a state machine."""
