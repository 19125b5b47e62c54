"""Kinds of steps, one module each. Importing the package imports and thereby registers every module."""

from importlib import import_module
from pkgutil import iter_modules

for _module in iter_modules(__path__, f"{__name__}."):
    import_module(_module.name)
