// What pybind11 does not do by itself for all classes and functions of the module.
#include <pybind11/pybind11.h>

#include <string>

#include "apps/python/bindings/bindings.hpp"

namespace nbd::python {

namespace py = pybind11;

namespace {

constexpr const char* without_init =
    "an object was made by __new__() alone; allowed: objects made by calling their class";

/// pybind11 asks for memory when a method is called on an object that has no C++ object yet.
void* refuse_memory(std::size_t) { throw py::type_error(without_init); }

PyCFunctionWithKeywords dispatch = nullptr;  // what pybind11 calls for each of its functions

/// Calls it. A line takes the place of pybind11's paragraph about arguments that fit no signature, and of its
/// riddle about shared objects made by __new__() alone.
PyObject* call_in_one_line(PyObject* self, PyObject* arguments, PyObject* named) {
    PyObject* result = dispatch(self, arguments, named);
    if (result || !(PyErr_ExceptionMatches(PyExc_TypeError) || PyErr_ExceptionMatches(PyExc_RuntimeError)))
        return result;
    py::error_already_set error;
    try {
        const std::string text = py::str(error.value());
        py::object line = py::none();
        if (text.starts_with("Unable to cast from non-held to held instance"))
            line = py::str(without_init);
        else if (text.find("arguments. The following argument types are supported:") != text.npos)
            line = py::module_::import("nbdtree._errors")
                       .attr("wrong_arguments")(text, py::handle(arguments),
                                                named ? py::handle(named) : py::handle(py::dict()));
        if (!line.is_none()) {
            PyErr_SetObject(PyExc_TypeError, line.ptr());
            return nullptr;
        }
    } catch (py::error_already_set&) {
        // The error stays as it was.
    }
    error.restore();
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
