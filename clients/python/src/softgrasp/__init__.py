"""Softgrasp from Python: displacements and forces of soft objects from a finite element server.

All numbers are in SI units: lengths in m, forces in N, moduli in Pa. Displacements count from the
shape at rest, in the frame of the mesh; contact frames say where that frame is in the world.
"""

from .address import Tls
from .answer import Answer, CaseAnswer, LargeAnswer, Reactions, SeveralAnswers
from .asynchronous import AsyncKeptModel, AsyncServer
from .body import Body, Box, Capsule, ClosedSurface, Plane, Shape, Sphere
from .calls import ModelReady, Welcome
from .contact import (
    BodyLoads,
    ContactAnswer,
    ContactPoints,
    ContactStep,
    ObjectState,
    candidate_triangles,
)
from .errors import (
    REFUSALS,
    BadRequest,
    BadStream,
    Busy,
    Cancelled,
    ClusterLost,
    ConnectionLost,
    DeadlineMissed,
    InternalFault,
    MemoryLimit,
    MeshFileError,
    NoAnswerInTime,
    NotAuthorised,
    NotCapable,
    NotPositiveDefinite,
    Refused,
    RigidMotionFree,
    ServerNotStarted,
    ShuttingDown,
    SoftgraspError,
    Superseded,
    TooLarge,
    Uncertain,
    UnknownMethod,
    UnknownModel,
    UnsupportedVersion,
)
from .field_values import FieldName, FieldValues, PlacedFields, WantedFields, matrices
from .large import LargeDeformation
from .limits import Limits
from .load_case import LoadCase, Mask, Pressure
from .mesh import Mesh
from .model import Element, Material, Model
from .pose import Pose
from .program import ServerProgram
from .quantity import Gradient, Quantity
from .question import Precision, Question, Report
from .report import ContactReport, LargeReport, SolveReport, StageTimes
from .server import KeptModel, Server
from .trace import traced
from .warning import AnswerWarning, WarningCode

__all__ = [
    "Answer",
    "AnswerWarning",
    "AsyncKeptModel",
    "AsyncServer",
    "BadRequest",
    "BadStream",
    "Body",
    "BodyLoads",
    "Box",
    "Busy",
    "Cancelled",
    "Capsule",
    "CaseAnswer",
    "ClosedSurface",
    "ClusterLost",
    "ConnectionLost",
    "ContactAnswer",
    "ContactPoints",
    "ContactReport",
    "ContactStep",
    "DeadlineMissed",
    "Element",
    "FieldName",
    "FieldValues",
    "Gradient",
    "InternalFault",
    "KeptModel",
    "LargeAnswer",
    "LargeDeformation",
    "LargeReport",
    "Limits",
    "LoadCase",
    "Mask",
    "Material",
    "MemoryLimit",
    "Mesh",
    "MeshFileError",
    "Model",
    "ModelReady",
    "NoAnswerInTime",
    "NotAuthorised",
    "NotCapable",
    "NotPositiveDefinite",
    "ObjectState",
    "PlacedFields",
    "Plane",
    "Pose",
    "Precision",
    "Pressure",
    "Quantity",
    "Question",
    "REFUSALS",
    "Reactions",
    "Refused",
    "Report",
    "RigidMotionFree",
    "Server",
    "ServerNotStarted",
    "ServerProgram",
    "SeveralAnswers",
    "Shape",
    "ShuttingDown",
    "SoftgraspError",
    "SolveReport",
    "Sphere",
    "StageTimes",
    "Superseded",
    "Tls",
    "TooLarge",
    "Uncertain",
    "UnknownMethod",
    "UnknownModel",
    "UnsupportedVersion",
    "WantedFields",
    "WarningCode",
    "Welcome",
    "candidate_triangles",
    "matrices",
    "traced",
]

__version__ = "0.1.0"
