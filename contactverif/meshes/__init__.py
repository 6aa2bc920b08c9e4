"""Reading a user's mesh file."""
