"""Which effects explain the free runs.

`plant` is the axis with its records as the engine's `Plant`: it simulates, and is asked for everything below.
`candidates` are effects of the library scaled to this axis, with where a search for each begins; `gear` looks for a
resonance, and `screened` are those that are tried where the balance shows their law. `describe` puts what was found
into words and numbers. `between` runs the engine, with what the drive does between its samples as the record shows it.
"""
