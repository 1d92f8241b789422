"""The balance of the records of an axis: `of_records` is all of it.

A `course` is a cycle as it was recorded, and `sampled` the motion along it. `widths` says how wide test functions must
be for the acceleration to be seen; `integrated` against them, a course is rows of the regression. `attenuation` undoes
what noise in the regressors takes from each coefficient. `own_zeros` are angle zeros as the balance sees them.
"""
