#pragma once

#include <cstdint>
#include <string>

namespace nbd::test {

/// What a comparison saw.
struct Comparison {
    long cases = 0;
    long hits = 0;        // cases that intersect, or answers that are not empty
    long degenerate = 0;  // cases with a triangle that is a segment or a point
    long different = 0;
    std::string first;  // the first case that differs, in words
};

/// Compares the library with exact geometry of small whole numbers, case by case. Case i depends on the seed
/// and on i alone; its grid is 1 to 8 wide, so that touching, coplanar and degenerate cases are common.

/// Intersection of two triangles in float, in both orders, and in double precision.
Comparison compare_triangles(std::uint64_t seed, long cases);

/// Distances: of a point and a triangle, of two edges, of two triangles.
Comparison compare_distances(std::uint64_t seed, long cases);

/// Queries of two bodies and of a body with itself: triangle soups of 8 to 40 faces, with boxes, exact
/// spheres and affine boxes, against every face with every other. Each answer is a case.
Comparison compare_queries(std::uint64_t seed, long cases);

}  // namespace nbd::test
