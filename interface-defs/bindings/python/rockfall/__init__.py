"""Solvers for rockfall in Python, and rockfall's runs from Python.

A solver: derive from `Structure` or `Contact`, and call `serve(it)`. A run: `run(scene, sets={...})`.
"""

from .runs import Results, RunFailed, run
from .solver import Contact, Fault, Field, Gauge, Mesh, Plan, Ready, Solver, Structure, Window, serve

__all__ = [
    "Contact",
    "Fault",
    "Field",
    "Gauge",
    "Mesh",
    "Plan",
    "Ready",
    "Results",
    "RunFailed",
    "Solver",
    "Structure",
    "Window",
    "run",
    "serve",
]
