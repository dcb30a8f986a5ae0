"""PanelArnoldi: stability of any cut on modes, by the leading multipliers of the one-period map on Gauss panels."""
