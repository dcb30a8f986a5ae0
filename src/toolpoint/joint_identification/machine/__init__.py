"""All joints of a machine at once, as springs between rigid bodies."""
