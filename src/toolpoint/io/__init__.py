"""Files in and out: one module per format, with read and write and nothing else; units are converted here."""
