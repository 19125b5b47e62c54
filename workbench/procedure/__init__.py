"""Loading, planning and running of procedures."""
