"""Records of controllers: tables of signals, traces of Sinumerik."""
