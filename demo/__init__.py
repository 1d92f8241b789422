"""The whole chain on this machine: runs the other programs, never imports them."""
