"""What more than one room must know of files that others define: below exporter and validation, knowing neither.

ls_ref.py      reference results in an FMU (FMI-LS-REF), read back
python_fmu.py  PythonFMU's library: whether it corrupts the heap at exit or after an exception
"""
