"""Reading a user's mesh file. Rule for the next editor: meshio is known here alone, besides the reports."""
