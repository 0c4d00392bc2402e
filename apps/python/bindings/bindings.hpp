#pragma once

#include <pybind11/pybind11.h>

// Each function adds the classes and functions of one subject to the module. The order matters: signatures
// name classes that were added before.
namespace nbd::python {

void bind_surfaces(pybind11::module_& module);    // surfaces, tetrahedra, files of these
void bind_bodies(pybind11::module_& module);      // bodies, materials, modes, cages
void bind_trees(pybind11::module_& module);       // collision trees and their poses
void bind_queries(pybind11::module_& module);     // queries between posed trees
void bind_features(pybind11::module_& module);    // features that may meet in a step
void bind_worlds(pybind11::module_& module);      // worlds and what their steps report
void bind_recordings(pybind11::module_& module);  // recordings, read and written
void bind_datasets(pybind11::module_& module);    // make_dataset
void bind_templates(pybind11::module_& module);   // scenes with variables and their datasets
void bind_training(pybind11::module_& module);    // tree files, training, what bounds cost and miss

/// Makes what pybind11 leaves to chance an error, in the classes and functions that were added: objects made
/// by __new__() alone raise when they are used, and errors in types are one line.
void guard(pybind11::module_& module);

}  // namespace nbd::python
