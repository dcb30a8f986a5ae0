"""Tests and cuts judged while they are recorded: blow by blow, window by window."""
