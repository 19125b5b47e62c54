"""Trials, one package each. Importing the package imports and thereby registers every trial."""

from importlib import import_module
from pkgutil import iter_modules

for _package in iter_modules(__path__, f"{__name__}."):
    if _package.ispkg:
        import_module(_package.name)
