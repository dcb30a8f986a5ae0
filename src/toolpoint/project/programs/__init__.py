"""NC programs of a project: the study of its machine along them, judged by the draws that its tests allow."""
