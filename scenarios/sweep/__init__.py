"""A parameter study over thousands of planting cycles, on all cores or a cluster, that can be stopped and continued."""
