"""Programs of five axes with tool centre control: the direction of the tool along the path, its poses, and their study."""
