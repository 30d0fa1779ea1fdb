"""Partners of the linkage in a field row, as PythonFMU slaves: drivetrain, conveyor, soil."""
