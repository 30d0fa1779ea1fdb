"""A row of plants: the linkage between drivetrain, conveyor and soil, run by our masters and by engines of others."""
