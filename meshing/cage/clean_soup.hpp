#pragma once

#include <string>

#include "meshing/surface/soup_report.hpp"

namespace nbd {

/// What clean_soup() found and dropped.
struct CleanSoupReport {
    SoupReport given;
    int dropped_vertices = 0;  // vertices that no kept face uses
};

/// One line, with all defects.
std::string describe(const CleanSoupReport& report);

/// Drops the faces that repeat a vertex and the vertices without a face. All others stay as they are, in
/// their order. Throws std::invalid_argument for an index out of range, a non-finite vertex, and a soup
/// without faces or extent.
CleanSoupReport clean_soup(TriMesh& soup);

}  // namespace nbd
