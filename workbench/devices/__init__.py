"""Device protocols and their real drivers."""
