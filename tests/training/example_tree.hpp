#pragma once

#include <map>
#include <string>

#include "training/files/tree_file.hpp"

namespace nbd::test {

struct ExampleTree {
    int grid = 8;  // a torus with grid^2 vertices and 2 grid^2 faces
    int depth = 3, modes = 5, representatives = 12;
};

/// A valid, calibrated tree file with random numbers in all of its models. Its vertices are its nodes.
TreeFile example_tree(const ExampleTree& config);

/// Networks of the model's shape with random float32 weights, which are not rounded to bytes.
NbdNetworks float_networks(const NbdModel& model);

/// Shape, type and bytes of each field of a tree, by its name in tree_fields.hpp.
std::map<std::string, std::string> fields_of(const CollisionTree& tree);

}  // namespace nbd::test
