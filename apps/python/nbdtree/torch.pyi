from os import PathLike
from typing import Any, Optional, Sequence, Tuple, Union

import numpy.typing as npt

from nbdtree import Body

PARTS: Tuple[str, ...]

def mesh_edges(T: npt.ArrayLike, E: Optional[npt.ArrayLike] = None) -> Any: ...

class Dataset:
    body: Body
    path: str
    window: int
    part: str
    split: str
    fields: Tuple[str, ...]
    contact_distance: Optional[float]
    edges: Any
    rest: Any
    def __init__(
        self,
        path: Union[str, "PathLike[str]"],
        body: Union[Body, str, "PathLike[str]"],
        window: int = ...,
        part: str = ...,
        contact_distance: Optional[float] = ...,
        split: str = ...,
        fields: Sequence[str] = ...,
    ) -> None: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: int) -> dict[str, Any]: ...
    def place(self, index: int) -> Tuple[int, int]: ...
    def statistics(self, windows: int = ...) -> dict[str, float]: ...
