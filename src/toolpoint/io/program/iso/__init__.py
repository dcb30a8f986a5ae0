"""G-code of ISO 6983: one block as moves, with what Fanuc and Siemens controls add to it."""
