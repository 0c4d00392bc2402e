"""Writes the types of the package, __init__.pyi: begin.pyi, then what the signatures of the compiled module say.

    python3 write_stubs.py FOLDER

FOLDER: holds the compiled module; gets the file.
"""

import ast
import inspect
import pathlib
import sys

SPECIAL = ("__init__", "__len__", "__contains__", "__enter__", "__exit__")
ARRAYS = {"float32": "Floats", "float64": "Doubles", "int32": "Indices"}
TAKEN = {"List": "Sequence", "list": "Sequence", "Dict": "Mapping", "dict": "Mapping"}  # by arguments
GIVEN = {"List": "list", "Dict": "dict", "tuple": "Tuple"}


class Names(ast.NodeTransformer):
    """Types as the stubs name them, of what pybind11 says of an argument or, if `is_given`, of a result."""

    def __init__(self, is_given):
        self.is_given = is_given

    def visit_Attribute(self, node):
        if node.attr != "PathLike":
            return ast.Name(node.attr)
        return ast.Constant("PathLike[str]") if self.is_given else ast.Name("Path")

    def visit_Name(self, node):
        return ast.Name((GIVEN if self.is_given else TAKEN).get(node.id, node.id))

    def visit_Subscript(self, node):
        text = ast.unparse(node)
        if text.startswith("numpy.ndarray["):
            return ast.Name(next(name for kind, name in ARRAYS.items() if kind in text))
        if text.startswith("Union[os.PathLike"):
            return ast.Name("Path")
        return self.generic_visit(node)


def function(name, item):
    """The function as stubs have it."""
    line = item.__doc__.splitlines()[0]
    node = ast.parse(f"def {line}: ...").body[0]
    node.name = name
    arguments = node.args
    required = len(arguments.args) - len(arguments.defaults)
    defaults = [None] * required + arguments.defaults + arguments.kw_defaults
    for argument, default in zip(arguments.args + arguments.kwonlyargs, defaults):
        type_ = ast.unparse(Names(False).visit(argument.annotation))
        is_none = isinstance(default, ast.Constant) and default.value is None
        optional = f"Optional[{type_}]" if is_none and "Optional" not in type_ and "None" not in type_ else type_
        argument.annotation = None if argument.arg == "self" else ast.Name(optional)
    arguments.defaults = [ast.Constant(...) for _ in arguments.defaults]
    arguments.kw_defaults = [value and ast.Constant(...) for value in arguments.kw_defaults]
    node.returns = Names(True).visit(node.returns)
    return ast.unparse(node).replace(":\n    ...", ": ...")


def members(made):
    for name, item in vars(made).items():
        if isinstance(item, property):
            result = ast.parse(f"def get{item.fget.__doc__.splitlines()[0]}: ...").body[0].returns
            yield f"{name}: Final[{ast.unparse(Names(True).visit(result))}]"
        elif not name.startswith("_") or (name in SPECIAL and inspect.isroutine(item) and "->" in (item.__doc__ or "")):
            yield function(name, item)
        elif name == "__eq__":
            yield "def __eq__(self, other: object) -> bool: ..."


def stubs(module):
    """The lines of all classes and functions, in the order in which the module has them."""
    for name, item in vars(module).items():
        if name.startswith("_") or (isinstance(item, type) and issubclass(item, BaseException)):
            continue
        if isinstance(item, type):
            yield "\n".join([f"class {name}:", *(f"    {member}" for member in members(item))])
        else:
            yield function(name, item)


if __name__ == "__main__":
    folder = pathlib.Path(sys.argv[1])
    sys.path.insert(0, str(folder))
    import _nbdtree

    begin = (pathlib.Path(__file__).parent / "begin.pyi").read_text()
    (folder / "__init__.pyi").write_text(begin + "\n" + "\n\n".join(stubs(_nbdtree)) + "\n")
