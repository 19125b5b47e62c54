"""Documentation site: pages gathered from the repository, built by MkDocs with the theme Material."""
