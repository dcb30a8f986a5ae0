"""Mesh files of solid elements: Abaqus .inp, Nastran bulk data, Ansys .cdb; one file a format."""
