"""`linkage-fmu validate`: what a team runs over an FMU before it goes into a system.

table.py    every check: its name, what it proves, where the standard says so
files.py    checks of what lies in the archive
runs.py     checks that run the FMU, in processes of their own
ours.py     checks that need this project's interface
subject.py  the FMU under test, and the run that the checks share
probe.py    the process in which the FMU is loaded; process.py is its other side
report.py   the table for people, JUnit XML for machines
"""
