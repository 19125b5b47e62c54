"""Campaigns: work on many sensors or sessions, in chunks that run on the workers of a Dask cluster.

A chunk's result depends on the campaign and the chunk's index only. It is kept as a Parquet file; a campaign
that was stopped continues with the chunks that are missing.
"""
