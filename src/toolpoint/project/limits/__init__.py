"""Limits of cuts by draws: machines or tips and coefficients that the tests allow, weighed by cuts that were tried."""
