"""Reach of a reduction: the frequency to which free modes of a body are kept, over the band of the coupled machine."""

DEFAULT_REACH_RATIO = 1.5  # of the band: free modes up to here are kept
MIN_TRUSTED_REACH_RATIO = 1.4  # of the band: with a smaller reach a mode may be missing, and the error estimate does not hold
