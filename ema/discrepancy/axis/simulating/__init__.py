"""What a free run is judged by, and the record run as a whole.

`pack` holds windows of one record in contiguous arrays; `predictable` says how long they may be. `noise_model` is what
noise makes of a free run of the right model, and `whitening` makes independent standard normal numbers of it.
`closed_loop` runs the whole record as its position loop does. The free runs themselves are `finding.plant`'s.
"""
