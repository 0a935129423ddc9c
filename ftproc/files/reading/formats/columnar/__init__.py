"""Parquet, Feather and Arrow files, whose columns pyarrow reads; what they unpack to is counted before."""
