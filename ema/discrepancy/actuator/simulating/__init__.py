"""The actuator simulated as its record was made.

`plant` simulates the cycles at any point of faults and effects, each run once (`runs`); `noise` says what two runs
differ by, and whether a residual is more.
"""
