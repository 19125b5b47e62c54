"""Parameters, priors, fit, covariance and what the data cannot determine."""
