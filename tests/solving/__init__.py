"""What one evaluation of the linkage costs and how exact it is: ours beside what a user would reach for.

`python -m tests.solving`, part of `make bench`, writes the section *Solving* of the report on speed and error.
"""
