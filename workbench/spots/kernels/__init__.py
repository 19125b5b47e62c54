"""Compiled loops (numba) behind the search for spots. numba loads slowly: import one where a fit runs."""
