"""Tables, figures and exports for people."""
