"""HillDeterminant: stability straight from a measured FRF, by Hill's determinant."""
