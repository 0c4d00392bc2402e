#pragma once

#include <pybind11/pybind11.h>

#include <string>

namespace nbd::python {

/// A dictionary of Python as JSON text. Arrays and numbers of numpy, tuples and paths become what JSON has
/// for them. Throws std::invalid_argument, with the path of the key, for a number that is not finite and for
/// what JSON does not have.
std::string json_text(pybind11::handle dictionary);

}  // namespace nbd::python
