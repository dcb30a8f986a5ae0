"""NC programs of a project: the study of its machine along them, with draws of the machine within its uncertainty."""
