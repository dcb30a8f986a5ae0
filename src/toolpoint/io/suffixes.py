"""Endings of file names and the formats that they mean."""

from __future__ import annotations

UNIVERSAL = (".uff", ".unv", ".uf")
HDF5 = (".h5", ".hdf5")
MATLAB = (".mat",)
NUMPY = (".npz", ".npy")
LVM, WAV, TDMS = (".lvm",), (".wav",), (".tdms",)
YAML = (".yaml", ".yml")
# Some endings stand in several lists (.mat, .dat): these files are asked what they hold, see `file_kinds`.
MATRICES = (".mtx", ".full", ".op4", ".pch", ".bdf", ".dat", ".nas", ".hb", ".rsa", ".rua", ".psa", ".mm", ".mat", ".npz",
            ".npy")
TEXT = (".txt", ".csv", ".frf", ".dat")
SOUND = (".flac", ".mp3", ".ogg", ".oga", ".opus", ".aiff", ".aif")
VIDEO = (".mp4", ".mov", ".m4v", ".m4a", ".mkv", ".avi", ".webm", ".3gp")
