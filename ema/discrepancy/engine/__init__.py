"""One score for every hypothesis: what a record makes of causes and faults, without knowing any plant.

A *hypothesis* is a set of causes with faults at a point of parameters. What a plant simulates there is random, so a
hypothesis predicts a distribution of records. Its score is a synthetic likelihood (Wood, Nature 466, 2010) of a few
statistics t of the record, whitened features projected on what the candidates can move:

    ℓ = -½ [ (t - μ)ᵀ C⁻¹ (t - μ) + log|C| ] + log p(rest),      C = Σ (1 + 1/N) + D

Mean μ and covariance Σ are of N simulated records of the hypothesis itself, so that hypotheses with different noise can
be compared; D is what the form of a law may leave, one and the same for all of them (Frazier and Drovandi, J. Comput.
Graph. Stat. 30, 2021). The evidence of a set is ℓ integrated over sizes and over subsets of faults.

=============  ===========================================================================================
`hypothesis`   parameters and causes as values, and what the engine asks of a plant
`records`      pools of seeds that are never mixed: what predicts, and what the statistics rest on
`statistic`    whitening, projection, rest
`law_error`    D: what a law of another form may leave, by what faults alone leave
`evidence`     the integral over sizes within bounds and over subsets of faults, closed form where linear
`posterior`    probabilities of sets, never surer than the evidence
`contest`      hypotheses that a search has fitted, weighed on one scale: whitening, statistics, law error
=============  ===========================================================================================
"""
