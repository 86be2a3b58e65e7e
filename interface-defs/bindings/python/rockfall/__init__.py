"""Solvers for rockfall in Python, and rockfall's runs from Python.

A solver: derive from `Structure` or `Contact`, and call `serve(it)`. A run: `run(scene, sets={...})`. A solver of others, window by window:
`Host(command, role, scene, out)`.
"""

from .host import Host
from .runs import Results, RunFailed, run
from .solver import Contact, Fault, Field, Gauge, Mesh, Plan, Ready, Solver, Structure, Window, serve

__all__ = [
    "Contact",
    "Fault",
    "Field",
    "Gauge",
    "Host",
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
