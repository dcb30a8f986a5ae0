"""Models over grid points: bars, springs, point masses and ties, assembled to stiffness and mass."""
