"""Types of the package, made from the compiled module, which has the texts."""

from os import PathLike
from typing import Any, Callable, ContextManager, Final, Mapping, Optional, Sequence, Tuple, TypedDict, Union

import numpy as np
import numpy.typing as npt

__version__: str

Path = Union[str, "PathLike[str]"]
Array = npt.ArrayLike
Floats = npt.NDArray[np.float32]
Doubles = npt.NDArray[np.float64]
Indices = npt.NDArray[np.int32]
# (data, indices, indptr), as scipy.sparse.csr_matrix takes them.
Weights = Tuple[npt.NDArray[Any], Indices, Indices]
Progress = Callable[[str, float, float], object]

class Stopped(KeyboardInterrupt): ...

class ClosestFaces(TypedDict):
    faces: Tuple[int, int]
    a: Doubles
    b: Doubles
    distance: float

class FeaturePairs(TypedDict):
    vertex_face: Indices
    edge_edge: Indices

class FreeStep(TypedDict):
    share: float
    limit: Optional[Tuple[str, int, int, int, int]]
    gap: float
    exhausted: bool

class CalibrationFacts(TypedDict):
    miss_rate: float
    confidence: float
    trajectories: int
    poses: int
    margins: Floats

class RecordedReactions(TypedDict):
    frame: Indices
    time: Doubles
    body: Indices
    kind: list[str]
    by: list[str]
    force: Doubles
    torque: Doubles
    pressure: Doubles
    volume: Doubles
    point: Doubles

class WorldRecording:
    def add_frame(self) -> None: ...

def recording(world: World, path: Path, scene_file: Optional[Path] = ...) -> ContextManager[WorldRecording]: ...
