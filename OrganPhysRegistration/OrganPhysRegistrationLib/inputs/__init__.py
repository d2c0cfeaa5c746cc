"""What goes into a registration: MRML nodes on one side, arrays in the CT or scene frame on the other."""
