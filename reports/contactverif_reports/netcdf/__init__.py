"""The netCDF report: its schema, how it is written, how it is read."""
