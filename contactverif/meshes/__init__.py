"""Reading mesh files and scene files of a user. Rule for the next editor: only this room and reports know meshlane."""
