#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>

#include "meshing/formats/surface_formats.hpp"

namespace nbd {
namespace {

using Triangles = std::vector<std::array<int, 3>>;

std::vector<int> all_of(const Nodes& X) {
    std::vector<int> corners(X.rows());
    std::iota(corners.begin(), corners.end(), 0);
    return corners;
}

Eigen::Vector3d area(const Nodes& X, int a, int b, int c) {
    const Eigen::Vector3d p = X.row(a), q = X.row(b), r = X.row(c);
    return (q - p).cross(r - p) / 2;
}

/// A star in a tilted plane, far from convex, whose corners alternate between two circles.
Nodes star(int corners) {
    const Eigen::Matrix3d turn =
        Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    Nodes X(corners, 3);
    for (int i = 0; i < corners; ++i) {
        const double angle = 2 * std::numbers::pi * i / corners,
                     r = i % 2 == 0 ? 1 : 0.6 + 0.2 * std::sin(9 * angle);
        X.row(i) = turn * Eigen::Vector3d(r * std::cos(angle), r * std::sin(angle), 0);
    }
    return X;
}

/// Triangles that turn as the polygon does and whose areas sum to its area overlap nowhere. Each side of the
/// polygon must be a side of one triangle, and all others of two.
void expect_valid(const Nodes& X, const std::vector<int>& corners) {
    const Triangles triangles = triangulate_polygon(X, corners);
    EXPECT_EQ(triangles.size(), corners.size() - 2);
    Eigen::Vector3d whole = Eigen::Vector3d::Zero();
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        whole += area(X, corners[0], corners[i], corners[i + 1]);
    double sum = 0;
    std::map<std::pair<int, int>, int> sides;
    for (const auto& [a, b, c] : triangles) {
        EXPECT_GT(area(X, a, b, c).dot(whole), 0) << a << ' ' << b << ' ' << c;
        sum += area(X, a, b, c).norm();
        for (const auto& [from, to] : {std::pair(a, b), {b, c}, {c, a}}) ++sides[{from, to}];
    }
    EXPECT_NEAR(sum, whole.norm(), 1e-9 * whole.norm());
    for (std::size_t i = 0; i < corners.size(); ++i) {
        const std::pair side(corners[i], corners[(i + 1) % corners.size()]);
        EXPECT_EQ(sides[side], 1);
        sides.erase(side);
    }
    for (const auto& [side, count] : sides) {
        const auto back = sides.find({side.second, side.first});
        EXPECT_EQ(count, 1);
        EXPECT_TRUE(back != sides.end()) << side.first << ' ' << side.second;
    }
}

TEST(TriangulatePolygon, CutsConcavePolygons) {
    Nodes X(6, 3);
    X << 0, 0, 0, 2, 0, 0, 2, 1, 0, 1, 1, 0, 1, 2, 0, 0, 2, 0;
    for (int first = 0; first < 6; ++first) {
        std::vector<int> corners = all_of(X);
        std::rotate(corners.begin(), corners.begin() + first, corners.end());
        expect_valid(X, corners);
        std::ranges::reverse(corners);
        expect_valid(X, corners);
    }
    for (const int corners : {10, 100, 1000}) expect_valid(star(corners), all_of(star(corners)));
    Nodes arrow(4, 3);
    arrow << 0, 0, 0, 2, 1, 0, 0, 2, 0, 0.5, 1, 0;
    for (int first = 0; first < 4; ++first) {
        std::vector<int> corners = all_of(arrow);
        std::rotate(corners.begin(), corners.begin() + first, corners.end());
        expect_valid(arrow, corners);
    }
}

TEST(TriangulatePolygon, CutsPolygonsWithCornersOnASide) {
    Nodes X(8, 3);
    X << 0, 0, 0, 1, 0, 0, 2, 0, 0, 2, 1, 0, 2, 2, 0, 1, 2, 0, 0, 2, 0, 0, 1, 0;
    expect_valid(X, all_of(X));
}

TEST(TriangulatePolygon, CutsAPolygonThatABridgeConnectsWithItsHole) {
    Nodes X(8, 3);
    X << 0, 0, 0, 3, 0, 0, 3, 3, 0, 0, 3, 0, 1, 1, 0, 1, 2, 0, 2, 2, 0, 2, 1, 0;
    const Triangles triangles = triangulate_polygon(X, std::vector{0, 1, 2, 3, 0, 4, 5, 6, 7, 4});
    EXPECT_EQ(triangles.size(), 8u);
    double sum = 0;
    for (const auto& [a, b, c] : triangles) {
        EXPECT_GT(area(X, a, b, c).z(), 0);
        sum += area(X, a, b, c).z();
    }
    EXPECT_NEAR(sum, 8, 1e-12);
}

/// Ear clipping takes minutes for so many.
TEST(TriangulatePolygon, CutsPolygonsOfManyCorners) {
    const Nodes X = star(40'000);
    expect_valid(X, all_of(X));
}

TEST(TriangulatePolygon, KeepsSurfacesClosedWhereThereIsNoCut) {
    Nodes bow(5, 3), line(5, 3), doubled(6, 3);
    bow << 0, 0, 0, 2, 2, 0, 2, 0, 0, 0, 2, 0, -1, 1, 0;
    line << 0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4;
    doubled << 0, 0, 0, 2, 0, 0, 1, 1, 0, 2, 2, 0, 0, 2, 0, 1, 1, 0;
    for (const Nodes& X : {bow, line, doubled}) {
        const int n = X.rows();
        Triangles fan;
        for (int i = 1; i + 1 < n; ++i) fan.push_back({0, i, i + 1});
        EXPECT_EQ(triangulate_polygon(X, all_of(X)), fan);
    }
}

}  // namespace
}  // namespace nbd
