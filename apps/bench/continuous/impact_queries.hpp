#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "collision/continuous/feature_pair.hpp"

namespace nbd {

/// One query: the vertex and the face's corners, or the ends of both edges.
using ImpactCorners = std::array<MovingPoint, 4>;

/// Queries of one kind from one scene, with their exact answers.
struct ImpactQueries {
    std::string scene;
    FeatureKind kind = FeatureKind::vertex_face;
    std::vector<ImpactCorners> queries{};
    std::vector<char> collides{};  // [queries]
};

/// Reads queries in the format of [WangEtAl21]: FOLDER/SCENE/{edge-edge,vertex-face}/*.csv, eight rows a
/// query, four corners at the begin and four at the end; numerator and denominator of x, y and z, and the
/// answer. Scenes and files in order of their names. Throws std::runtime_error, with file and line, for a row
/// of another form or a folder without queries. Coordinates are rounded to double precision.
std::vector<ImpactQueries> read_impact_queries(const std::filesystem::path& folder);

}  // namespace nbd
