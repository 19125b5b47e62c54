"""Kinds of steps, one module each. Importing the package registers all: a new module needs no edit here."""

from importlib import import_module
from pkgutil import iter_modules

for _module in iter_modules(__path__, f"{__name__}."):
    import_module(_module.name)
