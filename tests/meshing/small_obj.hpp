#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "meshing/mesh.hpp"

namespace nbd {

/// Reads a plain .obj of `v x y z` and `f a b c` lines, so that these tests need no importer.
inline TriMesh read_small_obj(const std::filesystem::path& path) {
    std::ifstream file(path);
    if (!file) throw std::runtime_error("cannot open " + path.string());
    std::vector<double> x;
    std::vector<int> corners;
    for (std::string line; std::getline(file, line);) {
        std::istringstream words(line);
        std::string kind;
        words >> kind;
        if (kind == "v")
            for (double value; words >> value;) x.push_back(value);
        if (kind == "f")
            for (int corner; words >> corner;) corners.push_back(corner - 1);
    }
    return {Eigen::Map<const Nodes>(x.data(), static_cast<Eigen::Index>(x.size() / 3), 3),
            Eigen::Map<const Faces>(corners.data(), static_cast<Eigen::Index>(corners.size() / 3), 3)};
}

}  // namespace nbd
