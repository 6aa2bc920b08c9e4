"""The store of compiled kernels, whose files are checked before numba believes them."""
