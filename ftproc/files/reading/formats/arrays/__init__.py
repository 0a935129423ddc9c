"""HDF5, netCDF, Matlab and numpy files: arrays of one length, in a group or structure or a matrix.

`vectors` says which arrays are the columns of a table; the others read one kind of file each, `rehearsal` in a process
of its own first where the reader may never come back.
"""
