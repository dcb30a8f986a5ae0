"""Reading: videos, image folders and raw frames into clips; what is wrong with them is said here."""
