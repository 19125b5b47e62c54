"""Statistics of range readings as pure functions; each module is one quantity of the field."""
