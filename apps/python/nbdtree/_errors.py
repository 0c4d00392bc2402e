"""One line for arguments that fit no signature."""

import re

_PARAGRAPH = re.compile(r"(?P<function>\w*)\(\): incompatible (?P<kind>function|constructor) arguments\..*?\n"
                        r"    1\. (?P<class>[\w.]*)\((self: [\w.]+(?:, )?)?(?P<parameters>.*?)\)(?: -> [^\n]*)?\n", re.DOTALL)


def _shown(value):
    """A value as a message shows it: short plain ones as they are, others by their type."""
    if value is None or isinstance(value, float) or type(value) in (bool, int, str):
        try:
            text = repr(value)
        except ValueError:  # a number of very many digits
            text = ""
        if 0 < len(text) <= 60:
            return text
    return type(value).__name__


def wrong_arguments(text, arguments, named):
    """text: of pybind11, whose first signature is told. arguments, named: those of the call, `self` among them."""
    found = _PARAGRAPH.match(text)
    if not found:
        return None
    of_object = found["kind"] == "constructor" or found[4] is not None
    shown = [_shown(value) for value in arguments[of_object:]] + [f"{key}={_shown(value)}" for key, value in named.items()]
    name = found["class"].rpartition(".")[2] or found["function"]
    allowed = f"{name}({found['parameters']})".replace("nbdtree._nbdtree.", "")
    return f"{name + '()' if name else 'property'}: was called with ({', '.join(shown)}); allowed: {allowed}"
