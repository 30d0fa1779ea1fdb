"""The hard cases: what a hostile reader would try, each measured once, for the tests and for the report."""
