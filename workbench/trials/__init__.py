"""Trials, one package each. Importing the package registers their steps: a new package needs no edit."""

from importlib import import_module
from pkgutil import iter_modules

for _package in iter_modules(__path__, f"{__name__}."):
    if _package.ispkg:
        import_module(_package.name)
