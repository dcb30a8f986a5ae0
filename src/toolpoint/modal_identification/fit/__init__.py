"""All poles refined at once with residues and what lies outside the band, and their covariance."""
