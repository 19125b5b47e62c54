"""The viewer's fixtures: a recorded session, and Rerun strict about what it is given."""

from tests.viewer.conftest import recorded, strict_rerun

__all__ = ["recorded", "strict_rerun"]
