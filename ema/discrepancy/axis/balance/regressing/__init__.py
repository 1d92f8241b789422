"""Which laws the rows need, and how sure each is. Nothing here knows where rows come from.

`rows` are the balance integrated, in blocks that can be held out; `regression` is least squares with intervals on which
blocks agree. `needed` asks whether the rows need a law, `choice` which laws they need and what cannot be told from
each, `creeping` whether rows in which the axis creeps are as others, `form` whether a law is the form of the others.
`apart` lets records have their own coefficients, and `agreement` asks whether they agree. `found` is the answer.
"""
