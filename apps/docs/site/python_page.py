"""Makes the reference of the Python package: signatures from its type stubs, texts from the docstrings of the module."""
import ast
import inspect
import textwrap


def signature(node):
    """A function of the stubs on one line, with its types."""
    returns = f" -> {ast.unparse(node.returns)}" if node.returns else ""
    return f"{node.name}({ast.unparse(node.args)}){returns}"


def docstring(thing):
    """The text of a docstring, without the signatures that pybind11 puts in front and the words for overloads."""
    lines = (inspect.getdoc(thing) or "").splitlines()
    name = getattr(thing, "__name__", "")
    kept = [line for line in lines
            if not (name and line.lstrip("0123456789. ").startswith(name + "(")) and line.strip() != "Overloaded function."]
    return textwrap.dedent("\n".join(kept)).strip()


def indented(text):
    """A text as a paragraph of a list's item."""
    return "\n" + textwrap.indent(" ".join(text.split()), "    ") + "\n" if text else ""


def members(node, thing):
    text, seen = "", set()
    for child in node.body:
        if isinstance(child, ast.AnnAssign):  # name: Final[type]
            name = child.target.id
            text += f"- `{name}: {ast.unparse(child.annotation.slice)}`\n{indented(docstring(getattr(thing, name, None)))}"
            continue
        if not isinstance(child, ast.FunctionDef) or (child.name.startswith("_") and child.name != "__init__"):
            continue
        label = signature(child).replace("self, ", "", 1).replace("(self)", "()", 1)
        if child.name == "__init__":
            label = f"{node.name}{label[len('__init__'):].removesuffix(' -> None')}"
        doc = "" if child.name in seen else docstring(getattr(thing, child.name, None))
        if child.name == "__init__" and doc.startswith("Initialize self"):
            doc = ""
        seen.add(child.name)
        text += f"- `{label}`\n{indented(doc)}"
    return text + "\n"


def python_page(module, stubs):
    """Markdown. module: the imported package. stubs: text of its __init__.pyi."""
    tree = ast.parse(stubs)
    text = f"# Python reference\n\n{docstring(module)}\n\nThe guide is [Python](../apps/docs/python.md).\n\n"
    classes = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")]
    text += "## Functions\n\n"
    seen = set()
    for node in functions:
        doc = "" if node.name in seen else docstring(getattr(module, node.name))
        seen.add(node.name)
        text += f"### {node.name}\n\n" if doc else ""
        text += f"```python\n{signature(node)}\n```\n\n{doc}\n\n"
    for node in classes:
        thing = getattr(module, node.name, None)
        if any(isinstance(base, ast.Name) and base.id == "TypedDict" for base in node.bases):
            fields = "\n".join(f"- `{ast.unparse(child)}`" for child in node.body if isinstance(child, ast.AnnAssign))
            text += f"## {node.name}\n\nA dictionary with these keys:\n\n{fields}\n\n"
        else:
            text += f"## {node.name}\n\n{docstring(thing)}\n\n{members(node, thing)}"
    return text
