"""Studies of videos: modes from a clip, and what they show of a machine's interfaces."""
