"""What was measured, its noise, and the lines that tell."""
