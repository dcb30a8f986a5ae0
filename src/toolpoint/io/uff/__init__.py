"""Universal files (UNV, UFF): sets 15, 55, 58, 58b, 82, 151, 164, 2411 read and written, 2412 and 2414 read; SI inside."""

from toolpoint.io.uff.file import (
    MeasuredGeometry,
    Units,
    UniversalFile,
    UniversalFunction,
    headers,
    read_frf,
    read_functions,
    read_geometry,
    read_modes,
    read_record,
    units,
    write,
)

__all__ = ["MeasuredGeometry", "Units", "UniversalFile", "UniversalFunction", "headers", "read_frf", "read_functions",
           "read_geometry", "read_modes", "read_record", "units", "write"]
