"""The linkage in numpy, for people to read, and its FMU by PythonFMU."""
