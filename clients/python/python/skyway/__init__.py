"""Skyway: exact, sub-millisecond recomposition of drone delivery routes.

The engine in the process is `Network`; a server of Skyway is asked by `Client` and `AsyncClient`; `demo()` starts one.
"""

from .async_client import AsyncClient
from .client import Client
from .errors import (
    AirspaceError,
    ConnectionBroken,
    FlightError,
    InternalError,
    NetworkError,
    Problem,
    ProgramError,
    RequestError,
    SkywayError,
)
from .events import Event
from .flight import Flight
from .many import Recompositions
from .network import Network
from .picture import Map
from .program import Demo, demo
from .results import Composition, FlownRecomposition, Recomposition, Stage, Verdict

__version__ = "0.1.0"

FAILURES = ("environmental", "operational", "navigational", "regulatory", "infrastructure", "service_level")
"""The failure types of the paper's Definition 3."""
STRATEGIES = ("exact", "two_phased", "cell_density", "radius", "dijkstra", "astar", "bellman_ford")
"""How a new path is found: the exact search, the paper's three, and the baselines."""

__all__ = [
    "FAILURES",
    "STRATEGIES",
    "AirspaceError",
    "AsyncClient",
    "Client",
    "Composition",
    "ConnectionBroken",
    "Demo",
    "Event",
    "Flight",
    "FlightError",
    "FlownRecomposition",
    "InternalError",
    "Map",
    "Network",
    "NetworkError",
    "Problem",
    "ProgramError",
    "Recomposition",
    "Recompositions",
    "RequestError",
    "SkywayError",
    "Stage",
    "Verdict",
    "demo",
]
