"""The same with a rigid master, whose ends feel nothing: matrix and force are the same."""

import matrix

matrix.show(False)
