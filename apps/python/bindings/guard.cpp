// What pybind11 does not do by itself for all classes and functions of the module.
#include <fmt/format.h>
#include <pybind11/pybind11.h>

#include <string>
#include <string_view>
#include <vector>

#include "apps/python/bindings/bindings.hpp"

namespace nbd::python {

namespace py = pybind11;

namespace {

constexpr const char* without_init =
    "an object was made by __new__() alone; allowed: objects made by calling their class";

/// pybind11 asks for memory when a method is called on an object that has no C++ object yet.
void* refuse_memory(std::size_t) { throw py::type_error(without_init); }

std::string without(std::string text, std::string_view part) {
    for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at))
        text.erase(at, part.size());
    return text;
}

/// A value as a message shows it: short plain ones as they are, others by their type.
std::string shown(py::handle value) {
    constexpr std::size_t most = 60;
    if (value.is_none() || PyFloat_Check(value.ptr()) || PyLong_CheckExact(value.ptr()) ||
        PyBool_Check(value.ptr()) || PyUnicode_CheckExact(value.ptr())) {
        try {
            std::string text = py::repr(value);
            if (text.size() <= most) return text;
        } catch (py::error_already_set&) {
            // Numbers of very many digits and broken texts have no short form.
        }
    }
    return py::type::of(value).attr("__name__").cast<std::string>();
}

std::string shown(py::handle arguments, py::handle named, std::size_t first) {
    std::vector<std::string> parts;
    const auto all = py::reinterpret_borrow<py::tuple>(arguments);
    for (std::size_t i = first; i < all.size(); ++i) parts.push_back(shown(all[i]));
    if (named)
        for (const auto& [name, value] : py::reinterpret_borrow<py::dict>(named))
            parts.push_back(fmt::format("{}={}", std::string(py::str(name)), shown(value)));
    return fmt::format("({})", fmt::join(parts, ", "));
}

/// A line instead of pybind11's paragraph about arguments that fit no signature, or its riddle about shared
/// objects made by __new__() alone; empty for other texts.
std::string one_line(const std::string& text, py::handle arguments, py::handle named) {
    if (text.starts_with("Unable to cast from non-held to held instance")) return without_init;
    constexpr std::string_view list = "    1. ";
    const auto begin = text.find(list), end = text.find('\n', begin == std::string::npos ? 0 : begin);
    if (text.find("arguments. The following argument types are supported:") == std::string::npos ||
        begin == std::string::npos || end == std::string::npos)
        return {};
    std::string signature = text.substr(begin + list.size(), end - begin - list.size());
    signature = without(signature.substr(0, signature.rfind(" -> ")), "nbdtree._nbdtree.");
    std::size_t first = 0;  // argument that the caller gave
    if (constexpr std::string_view self = "(self: "; signature.starts_with(self)) {
        const auto next = signature.find_first_of(",)");
        signature.erase(1, next - (signature[next] == ',' ? -1 : 1));
        first = 1;
    }
    if (text.find("(): incompatible constructor") != std::string::npos) first = 1;
    std::string name = text.substr(0, text.find("(): incompatible"));
    if (signature.starts_with("("))
        signature.insert(0, name);
    else
        name = signature.substr(0, signature.find('('));  // of the class
    return fmt::format("{}: was called with {}; allowed: {}", name.empty() ? "property" : name + "()",
                       shown(arguments, named, first), signature);
}

PyCFunctionWithKeywords dispatch = nullptr;  // what pybind11 calls for each of its functions

PyObject* call_in_one_line(PyObject* self, PyObject* arguments, PyObject* named) {
    PyObject* result = dispatch(self, arguments, named);
    if (result || !(PyErr_ExceptionMatches(PyExc_TypeError) || PyErr_ExceptionMatches(PyExc_RuntimeError)))
        return result;
    py::error_already_set error;
    std::string line;
    try {
        line = one_line(py::str(error.value()), arguments, named);
    } catch (py::error_already_set&) {
        // The error stays as it was.
    }
    if (line.empty())
        error.restore();
    else
        PyErr_SetString(PyExc_TypeError, line.c_str());
    return nullptr;
}

void shorten_errors(py::handle item) {
    if (!item || item.is_none()) return;
    if (PyInstanceMethod_Check(item.ptr())) return shorten_errors(PyInstanceMethod_GET_FUNCTION(item.ptr()));
    if (Py_IS_TYPE(item.ptr(), &PyProperty_Type)) {
        shorten_errors(item.attr("fget"));
        shorten_errors(item.attr("fset"));
        return;
    }
    if (!PyCFunction_CheckExact(item.ptr())) return;
    PyMethodDef* method = reinterpret_cast<PyCFunctionObject*>(item.ptr())->m_ml;
    const auto called =
        reinterpret_cast<PyCFunctionWithKeywords>(reinterpret_cast<void (*)()>(method->ml_meth));
    if (!dispatch) dispatch = called;
    if (called == dispatch)
        method->ml_meth = reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(call_in_one_line));
}

}  // namespace

void guard(py::module_& module) {
    for (const auto& [name, item] : module.attr("__dict__").cast<py::dict>()) {
        shorten_errors(item);
        if (!PyType_Check(item.ptr())) continue;
        auto* type = reinterpret_cast<PyTypeObject*>(item.ptr());
        if (py::detail::type_info* info = py::detail::get_type_info(type)) {
            info->operator_new = refuse_memory;
            for (const py::handle value : item.attr("__dict__").attr("values")()) shorten_errors(value);
        }
    }
}

}  // namespace nbd::python
