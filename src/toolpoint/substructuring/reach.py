"""How far beyond the band that is asked for the modes of a body are kept."""

REACH = 1.5  # of the band: free modes up to here are kept
SURE = 1.4  # least reach over band with which the error estimate is to be believed
