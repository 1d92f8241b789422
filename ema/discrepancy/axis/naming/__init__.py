"""What is said of an axis in the same way everywhere.

`naming` holds the names of free parameters and what they mean to the axis model, `linear` says metres and newtons
where an axis slides, and `interval` is the 95 % of what was drawn from an answer's uncertainty.
"""
