#pragma once

#include <pybind11/pybind11.h>

// Each function adds the classes and functions of one subject to the module. The order matters: signatures
// name classes that were added before.
namespace nbd::python {

void bind_surfaces(pybind11::module_& module);    // surfaces, tetrahedra, files of these
void bind_bodies(pybind11::module_& module);      // bodies, materials, modes
void bind_trees(pybind11::module_& module);       // collision trees and their poses
void bind_queries(pybind11::module_& module);     // queries between posed trees
void bind_worlds(pybind11::module_& module);      // worlds and what their steps report
void bind_recordings(pybind11::module_& module);  // recordings, read and written
void bind_datasets(pybind11::module_& module);    // make_dataset
void bind_training(pybind11::module_& module);    // training, calibration, evaluation

}  // namespace nbd::python
