#include "collision/geometry/skinning.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/geometry/divide_faces.hpp"

namespace nbd {
namespace {

constexpr double tolerance = 5e-6;  // of the sum of a vertex's weights; rounding W adds less than as much

/// Throws as the constructor of Skinning.
void check_skinning(const VerticesRef& X, const SurfaceEmbedding& weights) {
    if (weights.rows() != X.rows())
        throw std::invalid_argument(message("the bone weights have ", weights.rows(),
                                            " rows; allowed: one for each of the ", X.rows(), " vertices"));
    for (int v = 0; v < X.rows(); ++v) {
        if (!X.row(v).allFinite()) throw std::invalid_argument(message("vertex ", v, " is not finite"));
        int count = 0;
        double sum = 0;
        for (SurfaceEmbedding::InnerIterator entry(weights, v); entry; ++entry) {
            if (!(entry.value() >= 0 && std::isfinite(entry.value())))
                throw std::invalid_argument(message("vertex ", v, " has the bone weight ", entry.value(),
                                                    "; allowed: finite, 0 or more"));
            sum += double{entry.value()};
            count += entry.value() != 0;
        }
        if (count > Skinning::max_bones)
            throw std::invalid_argument(message("vertex ", v, " has ", count,
                                                " bone weights; allowed: at most ", Skinning::max_bones));
        if (!(std::abs(sum - 1) <= tolerance))
            throw std::invalid_argument(message("the bone weights of vertex ", v, " sum to ", sum,
                                                "; allowed: 1, within ", tolerance));
    }
}

/// A tetrahedron around points: as long as they are along their principal axes, with a face that touches them
/// on each of its four sides.
class Tetrahedron {
 public:
    explicit Tetrahedron(std::span<const Eigen::Vector3d> points) {
        const auto share = 1 / static_cast<double>(points.size());
        for (const Eigen::Vector3d& p : points) mean_ += share * p;
        Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
        for (const Eigen::Vector3d& p : points) spread += share * (p - mean_) * (p - mean_).transpose();
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
        axes_ = solver.eigenvectors();
        const double longest = std::sqrt(std::max(solver.eigenvalues()[2], 0.));
        for (int a = 0; a < 3; ++a) {
            const double length = std::sqrt(std::max(solver.eigenvalues()[a], 0.));
            scale_[a] = longest > 0 ? std::max(length, 1e-3 * longest) : 1;
        }
        offsets_.fill(0);
        for (const Eigen::Vector3d& p : points)
            for (std::size_t i = 0; i < 4; ++i)
                offsets_[i] = std::max(offsets_[i], normals[i].dot(scaled(p)));
        // The volume must not vanish, not even around a single point.
        for (double& offset : offsets_) {
            offset += 1e-3;
            sum_ += offset;
        }
    }

    /// The corner opposite to a face.
    Eigen::Vector3d corner(int face) const {
        const std::size_t i = face;
        // The normals n have sum 0 and sum n n^T = 4 I.
        Eigen::Vector3d q = -sum_ * normals[i];
        for (std::size_t j = 0; j < 4; ++j) q += offsets_[j] * normals[j];
        return mean_ + axes_ * scale_.cwiseProduct(q / 4);
    }
    /// Barycentric coordinate of one of the points, > 0; the four have sum 1.
    double coordinate(int corner, const Eigen::Vector3d& p) const {
        const std::size_t i = corner;
        return (offsets_[i] - normals[i].dot(scaled(p))) / sum_;
    }

 private:
    static inline const std::array<Eigen::Vector3d, 4> normals{
        Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, -1, -1), Eigen::Vector3d(-1, 1, -1),
        Eigen::Vector3d(-1, -1, 1)};

    /// Place along the principal axes, in standard deviations.
    Eigen::Vector3d scaled(const Eigen::Vector3d& p) const {
        return (axes_.transpose() * (p - mean_)).cwiseQuotient(scale_);
    }

    Eigen::Vector3d mean_ = Eigen::Vector3d::Zero(), scale_;
    Eigen::Matrix3d axes_;
    std::array<double, 4> offsets_;  // of the faces, along their normals
    double sum_ = 0;
};

/// Divides vertices at medians along the longest side of their box and calls patch() for each part.
void divide(VerticesRef X, std::span<int> vertices, const std::function<void(std::span<int>)>& patch) {
    if (vertices.size() <= Skinning::max_patch) return patch(vertices);
    const std::size_t middle = vertices.size() / 2;
    split_points(X, vertices, middle);
    divide(X, vertices.first(middle), patch);
    divide(X, vertices.subspan(middle), patch);
}

}  // namespace

Skinning::Skinning(VerticesRef X, const SurfaceEmbedding& weights) : bone_count_(weights.cols()) {
    check_skinning(X, weights);
    std::vector<Eigen::Vector3f> nodes;
    std::vector<Eigen::Triplet<float>> entries;
    const auto add_patch = [&](std::span<const int> vertices) {
        std::map<int, std::vector<std::pair<int, float>>> followers;  // of each bone, with their weights
        for (const int v : vertices)
            for (SurfaceEmbedding::InnerIterator entry(weights, v); entry; ++entry)
                if (entry.value() != 0) followers[entry.col()].emplace_back(v, entry.value());
        for (const auto& [bone, with_weights] : followers) {
            std::vector<Eigen::Vector3d> points;
            for (const auto& [v, weight] : with_weights)
                points.push_back(X.row(v).transpose().cast<double>());
            const Tetrahedron around(points);
            for (int i = 0; i < 4; ++i) {
                for (std::size_t p = 0; p < points.size(); ++p)
                    entries.emplace_back(
                        with_weights[p].first, nodes.size(),
                        static_cast<float>(double{with_weights[p].second} * around.coordinate(i, points[p])));
                nodes.emplace_back(around.corner(i).cast<float>());
            }
            bones_.push_back(bone);
        }
    };
    std::vector<int> vertices(X.rows());
    std::iota(vertices.begin(), vertices.end(), 0);
    divide(X, vertices, add_patch);
    rest_nodes_.resize(nodes.size(), 3);
    for (std::size_t i = 0; i < nodes.size(); ++i) rest_nodes_.row(i) = nodes[i].transpose();
    W_.resize(X.rows(), rest_nodes_.rows());
    W_.setFromTriplets(entries.begin(), entries.end());
}

void Skinning::pose(std::span<const BoneTransform> bones, Vertices& nodes) const {
    if (!std::cmp_equal(bones.size(), bone_count()))
        throw std::invalid_argument(
            message(bones.size(), " bone transforms; allowed: one for each of the ", bone_count(), " bones"));
    nodes.resize(rest_nodes_.rows(), 3);
    for (Eigen::Index i = 0; i < nodes.rows(); ++i) {
        const int bone = bones_[i / 4];
        const BoneTransform& M = bones[bone];
        nodes.row(i) = rest_nodes_.row(i) * M.leftCols<3>().transpose() + M.col(3).transpose();
    }
}

}  // namespace nbd
