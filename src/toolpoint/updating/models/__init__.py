"""What a model predicts of targets, with slopes."""
