"""Matrix files: Matrix Market, Abaqus .mtx, Nastran OP4 and DMIG, Harwell-Boeing, Ansys .full; one file a format."""
