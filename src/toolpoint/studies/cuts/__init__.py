"""Questions asked of cuts: charts, maps, simulations, uncertainty, calibration; the dynamics of the tool that they stand on."""
