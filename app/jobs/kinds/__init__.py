"""What can be asked for, one kind a file; `known` lists them."""
