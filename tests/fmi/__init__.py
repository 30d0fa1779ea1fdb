"""The interfaces of FMI 2.0 and 3.0, called through the shared library."""
