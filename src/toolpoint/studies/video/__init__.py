"""Studies of videos: modes from a clip, and what they say about a machine's interfaces."""
