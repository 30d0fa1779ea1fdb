"""The best design for a question: optimisation of the linkage by the exact gradients of its FMU."""

import os

# The systems of equations are small: several threads a system would wait for each other, fivefold on a busy machine.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
