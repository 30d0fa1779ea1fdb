"""What the product is held against: the mechanism in 50-digit arithmetic, its tables, and the paper's own equations.

It makes the reference results that the FMUs carry. Nothing of the product imports it, it is not in the wheel, and it
needs mpmath, which the product does not.
"""
