"""Many recordings: found, diagnosed by processes or on a Dask cluster, kept to resume from."""
