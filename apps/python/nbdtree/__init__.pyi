"""Types of the package; the compiled part has the texts."""

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

def thread_count() -> int: ...
def set_thread_count(count: int) -> None: ...

class TriMesh:
    def __init__(self, X: Array, F: Array) -> None: ...
    X: Final[Doubles]
    F: Final[Indices]

class TetMesh:
    def __init__(self, X: Array, T: Array) -> None: ...
    X: Final[Doubles]
    T: Final[Indices]

def read_surface(path: Path) -> TriMesh: ...
def write_surface(path: Path, mesh: TriMesh) -> None: ...
def read_tets(path: Path) -> TetMesh: ...
def make_solid_boundary(
    surface: TriMesh, allow_components: bool = ..., allow_self_intersection: bool = ...
) -> Tuple[TriMesh, str]: ...
def tetrahedralize(
    surface: TriMesh, nodes: int = ..., tolerance: float = ..., grading: float = ...
) -> TetMesh: ...
def subdivide(surface: TriMesh, levels: int = ..., scheme: str = ...) -> TriMesh: ...

class Material:
    def __init__(
        self,
        young: float = ...,
        poisson: float = ...,
        density: float = ...,
        rayleigh_mass: float = ...,
        rayleigh_stiffness: float = ...,
        law: str = ...,
    ) -> None: ...
    young: Final[float]
    poisson: Final[float]
    density: Final[float]
    rayleigh_mass: Final[float]
    rayleigh_stiffness: Final[float]
    law: Final[str]
    def __eq__(self, other: object) -> bool: ...

class Modes:
    U: Final[Floats]
    frequencies: Final[Doubles]
    max_residual: Final[float]
    max_rigid_hz: Final[float]

class Body:
    name: Final[str]
    origin: Final[Doubles]
    X: Final[Doubles]
    T: Final[Indices]
    surface_X: Final[Doubles]
    F: Final[Indices]
    tets: Final[TetMesh]
    surface: Final[TriMesh]
    W: Final[Weights]
    material: Final[Material]
    modes: Final[Optional[Tuple[Floats, Doubles]]]
    hash: Final[str]
    def surface_positions(self, x: Array) -> Doubles: ...
    def with_modes(self, modes: Modes) -> Body: ...
    def with_material(self, material: Material) -> Body: ...

def make_body(
    name: str,
    tets: TetMesh,
    surface: Optional[TriMesh] = ...,
    material: Material = ...,
    levels: int = ...,
    scheme: str = ...,
) -> Body: ...
def mesh_file(
    path: Path,
    nodes: Optional[int] = ...,
    grading: Optional[float] = ...,
    cage: Optional[int] = ...,
    inside: Optional[Path] = ...,
    material: Optional[Material] = ...,
    levels: Optional[int] = ...,
    scheme: Optional[str] = ...,
    scale: float = ...,
    weld: Optional[float] = ...,
) -> Body: ...
def save_body(path: Path, body: Body) -> None: ...
def load_body(path: Path) -> Body: ...
def vibration_modes(body: Body, count: int = ..., seed: int = ...) -> Modes: ...

class TetQuality:
    nodes: Final[int]
    tets: Final[int]
    volume: Final[float]
    volume_min: Final[float]
    radius_ratio_min: Final[float]
    radius_ratio_mean: Final[float]
    dihedral_min: Final[float]
    dihedral_max: Final[float]
    worst_tet: Final[int]
    poor: Final[int]
    radius_ratio_histogram: Final[list[int]]

def tet_quality(tets: TetMesh) -> TetQuality: ...

class CageReport:
    vertices: Final[int]
    faces: Final[int]
    volume: Final[float]
    alpha: Final[float]
    offset: Final[float]
    distance: Final[float]
    closes_holes: Final[bool]
    joins_parts: Final[bool]
    defects: Final[dict[str, int]]
    tets_optimised: Final[int]

def make_cage_body(name: str, surface: TriMesh, nodes: int, material: Material = ...) -> Tuple[Body, CageReport]: ...

class CollisionTree:
    vertex_count: Final[int]
    faces: Final[Indices]
    node_count: Final[int]
    depth: Final[int]
    rest_spheres: Final[Floats]
    node_depths: Final[Indices]
    bounds: Final[list[str]]
    calibrations: Final[dict[str, CalibrationFacts]]
    def on_nodes(self, W: Any, rest: Array) -> CollisionTree: ...

def make_exact_tree(X: Array, F: Array, depth: int = ..., min_leaf_faces: int = ...) -> CollisionTree: ...
def tree_of_body(body: Body, depth: int = ...) -> CollisionTree: ...
def load_flat_tree(path: Path) -> CollisionTree: ...
def save_flat_tree(path: Path, tree: CollisionTree) -> None: ...

class PosedTree:
    def __init__(self, tree: CollisionTree, bounds: str = ..., margin: Optional[float] = ...) -> None: ...
    def begin_pose(self, x: Floats, check: bool = ...) -> None: ...
    def begin_pose_of_nodes(self, nodes: Floats, check: bool = ...) -> None: ...
    def begin_step(self, start: Floats, end: Floats, check: bool = ...) -> None: ...
    def sphere(self, node: int) -> Tuple[Floats, float]: ...
    def whole(self) -> Tuple[Floats, Floats]: ...
    nodes_bounded: Final[int]
    nodes_out_of_range: Final[int]
    bounds: Final[str]
    chosen: Final[str]

class PairQuery:
    def __init__(self) -> None: ...
    def intersecting(self, a: PosedTree, b: PosedTree) -> Indices: ...
    def within(self, a: PosedTree, b: PosedTree, distance: float) -> Indices: ...
    def boxes_within(self, a: PosedTree, b: PosedTree, distance: float) -> Indices: ...
    counters: Final[dict[str, int]]

class FacePairSet:
    def __len__(self) -> int: ...
    def __contains__(self, pair: Tuple[int, int]) -> bool: ...

def near_at_rest(X: Array, F: Array, distance: float) -> FacePairSet: ...

class SelfQuery:
    def __init__(self, left_out: Optional[FacePairSet] = ...) -> None: ...
    def intersecting(self, body: PosedTree) -> Indices: ...
    def within(self, body: PosedTree, distance: float) -> Indices: ...

class ClosestQuery:
    def __init__(self) -> None: ...
    def closest(self, a: PosedTree, b: PosedTree, most: float = ...) -> Optional[ClosestFaces]: ...

class ManyBodyQuery:
    def __init__(self) -> None: ...
    def intersecting(self, bodies: Sequence[PosedTree]) -> list[Tuple[int, int, Indices]]: ...
    def within(self, bodies: Sequence[PosedTree], distance: float) -> list[Tuple[int, int, Indices]]: ...

class MovingBody:
    def __init__(self, X: Array, F: Array, role: str = ...) -> None: ...
    def move(self, begin: Array, end: Array) -> None: ...
    def pose(self, x: Array) -> None: ...
    def at(self, share: float) -> Doubles: ...
    F: Final[Indices]
    edges: Final[Indices]

class FeatureQuery:
    def __init__(self) -> None: ...
    def candidates(self, bodies: Sequence[MovingBody], distance: float) -> FeaturePairs: ...
    def collision_free_step(self, bodies: Sequence[MovingBody], separation: float, left: float = ...) -> FreeStep: ...

def intersecting_faces(xa: Array, fa: Array, xb: Array, fb: Array) -> Indices: ...
def face_pairs_within(xa: Array, fa: Array, xb: Array, fb: Array, distance: float) -> Indices: ...
def closest_points(xa: Array, fa: Array, xb: Array, fb: Array) -> ClosestFaces: ...

class WorldReport:
    time: Final[float]
    contacts: Final[int]
    face_pairs: Final[int]
    pairs_measured: Final[int]
    nodes_bounded: Final[int]
    nodes_out_of_range: Final[int]
    patches: Final[int]
    patches_proved: Final[int]
    proof_us: Final[float]
    update_us: Final[float]
    collision_us: Final[float]
    detect_us: Final[float]
    substeps: Final[int]
    newton_iterations: Final[int]
    assemble_us: Final[float]
    solve_us: Final[float]
    rest_us: Final[float]
    solver_iterations: Final[int]
    solver_converged: Final[bool]
    kinetic_energy: Final[float]
    elastic_energy: Final[float]
    gravity_energy: Final[float]
    deepest_penetration: Final[float]
    least_distance: Final[float]
    inverted_elements: Final[int]
    # "", "approach", "linear_solver", "newton", "overlap", "contact_passes" or "inverted".
    trouble: Final[str]
    trouble_reason: Final[str]
    failure: Final[str]

class WorldSnapshot:
    time: Final[float]

class World:
    def __init__(self, scene: Union[Path, Mapping[str, Any]], folder: Optional[Path] = ...) -> None: ...
    def __len__(self) -> int: ...
    def step(self, dt: Optional[float] = ...) -> WorldReport: ...
    def check_start(self) -> None: ...
    def resolve_start(self) -> list[Tuple[int, Doubles]]: ...
    start_moves: Final[list[Tuple[int, Doubles]]]
    time: Final[float]
    origin: Final[Doubles]
    dt: Final[float]
    frames: Final[int]
    steps_per_frame: Final[int]
    seed: Final[int]
    scene: Final[str]
    thickness: Final[float]
    bodies: Final[list[Body]]
    names: Final[list[str]]
    def positions(self, body: int = ...) -> Doubles: ...
    def velocities(self, body: int = ...) -> Doubles: ...
    def forces(self, body: int = ...) -> Doubles: ...
    def contact_forces(self, body: int = ...) -> Doubles: ...
    def masses(self, body: int = ...) -> Doubles: ...
    def surface_positions(self, body: int = ...) -> Doubles: ...
    def drive(self, nodes: Array, targets: Array, body: int = ...) -> None: ...
    def snapshot(self) -> WorldSnapshot: ...
    def restore(self, snapshot: WorldSnapshot) -> None: ...
    def intersecting(self, a: int, b: int) -> Indices: ...
    def intersecting_faces(self) -> list[Tuple[int, int, int, int]]: ...
    def begin_pose(self, body: int, tree: PosedTree) -> None: ...

class TrajectoryInfo:
    id: Final[int]
    seed: Final[int]
    body_hash: Final[str]
    recipe: Final[str]
    failure: Final[str]
    frames: Final[int]

class RecordingReader:
    def __init__(self, path: Path) -> None: ...
    path: Final["PathLike[str]"]
    origin: Final[Doubles]
    trajectories: Final[list[TrajectoryInfo]]
    frames: Final[int]
    def nodes(self, trajectory: int) -> int: ...
    def read(self, trajectory: int, begin: int = ..., count: Optional[int] = ...) -> Floats: ...
    def extras(self, trajectory: int) -> list[str]: ...
    def read_field(self, trajectory: int, field: str, begin: int = ..., count: Optional[int] = ...) -> Floats: ...
    def contact_edges(self, trajectory: int, begin: int = ..., count: Optional[int] = ...) -> list[Indices]: ...
    def times(self, trajectory: int) -> Doubles: ...
    def facts(self, trajectory: int) -> dict[str, Indices]: ...
    def label(self, name: str) -> str: ...

class RecordingWriter:
    def __init__(self, path: Path, origin: Optional[Sequence[float]] = ...) -> None: ...
    def begin_trajectory(
        self, nodes: int, id: int, body_hash: str = ..., seed: int = ..., recipe: str = ...
    ) -> int: ...
    def add_frame(self, handle: int, time: float, x: Array) -> None: ...
    def end_trajectory(self, handle: int, failure: str = ..., facts: Mapping[str, Array] = ...) -> None: ...
    def label(self, name: str, value: str) -> None: ...
    def finish(self) -> None: ...
    def abandon(self) -> None: ...
    def __enter__(self) -> RecordingWriter: ...
    def __exit__(self, type: Any, value: Any, traceback: Any) -> None: ...

class WorldRecording:
    def add_frame(self) -> None: ...

def recording(world: World, path: Path, scene_file: Optional[Path] = ...) -> ContextManager[WorldRecording]: ...
def remap(recording: Path, path: Path, source: Body, target: Body, trajectories: int = ...) -> int: ...
def make_dataset(
    body: Body,
    path: Path,
    *,
    trajectories: int = ...,
    frames: int = ...,
    seed: int = ...,
    strength: Optional[float] = ...,
    recipe: Union[Path, Mapping[str, Any], None] = ...,
    frame_interval: float = ...,
    steps_per_frame: int = ...,
    self_contact: bool = ...,
    intersection_free: bool = ...,
    held_out: float = ...,
    per_shard: int = ...,
    licence: str = ...,
    hold_out: str = ...,
    contact_forces: bool = ...,
    stress: bool = ...,
    deformation_gradients: bool = ...,
    contact_edges: bool = ...,
    progress: Optional[Progress] = ...,
) -> None: ...

def dataset_manifest(path: Path) -> dict[str, Any]: ...
def is_dataset(path: Path) -> bool: ...
def check_file(path: Path, body: Optional[Path] = ...) -> str: ...

class TreeFile:
    tree: Final[CollisionTree]
    X: Final[Floats]
    W: Final[Weights]
    facts: Final[dict[str, Any]]
    def surface_positions(self, x: Array) -> Floats: ...

def load_tree(path: Path) -> TreeFile: ...
def save_tree(path: Path, file: TreeFile) -> None: ...
def train(
    body: Body,
    recording: Path,
    bounds: Sequence[str] = ...,
    *,
    depth: Optional[int] = ...,
    modes: int = ...,
    clusters: int = ...,
    network: str = ...,
    epochs: int = ...,
    held_out: Optional[float] = ...,
    calibration: float = ...,
    random_frames: float = ...,
    split: str = ...,
    miss_rate: float = ...,
    confidence: Optional[float] = ...,
    seed: int = ...,
    checkpoint: Optional[Path] = ...,
    progress: Optional[Progress] = ...,
) -> TreeFile: ...
def calibrate(file: TreeFile, recording: Path, miss_rate: float = ..., confidence: Optional[float] = ...) -> TreeFile: ...
def transfer_tree(file: TreeFile, body: Body) -> TreeFile: ...

class EvaluationRow:
    frames: Final[str]
    bound: Final[str]
    depth: Final[int]
    margin: Final[float]
    radius_error: Final[float]
    inflation: Final[float]
    centre_error: Final[float]
    vertices_outside: Final[float]
    nodes_missing: Final[float]
    poses: Final[int]
    nodes: Final[int]
    vertices: Final[int]

def evaluate(
    file: TreeFile,
    recording: Path,
    bounds: Optional[Sequence[str]] = ...,
    margins: Sequence[float] = ...,
    max_frames: int = ...,
) -> list[EvaluationRow]: ...

class CoverageRow:
    bound: Final[str]
    depth: Final[int]
    trajectories: Final[int]
    poses: Final[int]
    miss_rate: Final[float]
    confidence: Final[float]
    keeping: Final[int]
    keeping_share: Final[Tuple[float, float]]
    nodes_missing: Final[float]
    nodes_missing_mean: Final[Tuple[float, float]]
    vertices_outside: Final[float]
    inflation: Final[float]
    out_of_range: Final[float]

def measure_coverage(file: TreeFile, recording: Path, bounds: Optional[Sequence[str]] = ...) -> list[CoverageRow]: ...

class ContactScenesRow:
    bound: Final[str]
    scenes: Final[int]
    scenes_missing: Final[int]
    face_pairs: Final[int]
    missed: Final[int]
    missed_share: Final[Tuple[float, float]]
    nodes_bounded: Final[float]
    leaf_pairs: Final[float]
    exact_leaf_pairs: Final[float]
    out_of_range: Final[float]

def check_contact_scenes(
    file: TreeFile,
    recording: Path,
    bounds: Optional[Sequence[str]] = ...,
    *,
    scenes: int = ...,
    deepest: float = ...,
    seed: int = ...,
) -> list[ContactScenesRow]: ...

class RandomSplitsRow:
    depth: Final[int]
    splits: Final[int]
    calibration: Final[int]
    test: Final[int]
    stated: Final[float]
    keeping: Final[float]
    nodes_missing: Final[float]
    highest: Final[float]

def check_random_splits(file: TreeFile, recording: Path, bound: str, splits: int = ...) -> list[RandomSplitsRow]: ...
