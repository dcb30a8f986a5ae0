"""Questions about cuts: charts, maps, simulations, uncertainty, calibration, and the tool dynamics that they need."""
