#include "collision/wide_tree/learned_affine.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "collision/base/message.hpp"
#include "collision/base/prefetch.hpp"

namespace nbd {
namespace {

constexpr Requirement require("learned affine bounds");

/// AffineModel::rounding() of a surface whose vertices have one weight.
constexpr float rounding = 34.01f * 0x1p-24f;

void require_count(std::size_t count, std::size_t expected, const char* what) {
    require(count == expected, "has ", count, " ", what, " instead of ", expected);
}

void require_numbers(std::span<const float> numbers, const char* what) {
    for (const float number : numbers)
        require(number >= 0 && std::isfinite(number), what, " is ", number, ", allowed: finite, 0 or more");
}

void check(const WideTree& tree, const LearnedAffineFit& fit) {
    const auto clusters = static_cast<std::size_t>(tree.clusters()),
               parts = clusters + static_cast<std::size_t>(tree.blocks());
    require(tree.vertex_count <= AffineParts::most_nodes, "has ", tree.vertex_count,
            " vertices, allowed: at most ", AffineParts::most_nodes);
    require_count(fit.X.rows(), tree.vertex_count, "rest positions");
    require(fit.X.allFinite(), "a rest position is not finite");
    require_count(fit.samples.size(), parts * LearnedAffineFit::samples_per_part, "samples");
    require_count(fit.box_samples.size(), clusters * LearnedAffineFit::samples_per_box, "samples of boxes");
    for (const std::vector<int>* samples : {&fit.samples, &fit.box_samples})
        for (const int v : *samples)
            require(v >= 0 && v < tree.vertex_count, "sample vertex ", v, ", but the surface has ",
                    tree.vertex_count, " vertices");
    require_count(fit.clusters.size(), clusters, "boxes of clusters");
    for (const BoxFit& box : fit.clusters)
        require_numbers({{box.growth, box.mean, box.inverse_deviation}}, "a number of a cluster's box");
    require_count(fit.residual.size(), parts, "residuals");
    require_numbers(fit.residual, "a residual");
    require(std::ranges::find(fit.residual, 0.f) == fit.residual.end(), "a residual is 0, allowed: above 0");
    require_count(fit.growth.size(), parts * tree_width, "growths");
    require_numbers(fit.growth, "a growth");
}

/// Throws unless the samples are vertices of their part, which are given in ascending order: else the fit is
/// of another tree over the same surface, and its boxes would miss.
void require_own(std::span<const int> samples, const std::vector<int>& vertices, int part) {
    for (const int v : samples)
        require(std::ranges::binary_search(vertices, v), "sample vertex ", v, " is not one of part ", part);
}

/// The samples that are nearest to the middle of a child at rest, ascending where they are equally near.
std::vector<int> nearest(std::vector<int> samples, const std::vector<int>& child, const Vertices& X) {
    if (child.empty()) return {};
    Eigen::RowVector3d middle = Eigen::RowVector3d::Zero();
    for (const int v : child) middle += X.row(v).cast<double>() / static_cast<double>(child.size());
    std::ranges::stable_sort(samples, {},
                             [&](int v) { return (X.row(v).cast<double>() - middle).squaredNorm(); });
    samples.resize(std::min(samples.size(), std::size_t{LearnedAffineModel::carriers}));
    return samples;
}

/// The unit of AffineParts' rest coordinates, metres.
float resolution(const std::vector<int>& samples, const Vertices& X) {
    Eigen::Array3f lo = X.row(samples.front()).array().transpose(), hi = lo;
    for (const int v : samples) {
        lo = lo.min(X.row(v).array().transpose());
        hi = hi.max(X.row(v).array().transpose());
    }
    return std::max((hi - lo).maxCoeff() * 0x1p-15f, std::numeric_limits<float>::min());
}

}  // namespace

LearnedAffineModel::LearnedAffineModel(const WideTree& tree, LearnedAffineFit fit)
    : fit_(std::move(fit)), parts_of_(tree.clusters() + tree.blocks()) {
    check(tree, fit_);
    for (const int v : fit_.box_samples) box_places_.push_back(3 * v);
    for (int part = 0; part < parts_of_; ++part) {
        const auto first = fit_.samples.begin() + std::ptrdiff_t{part} * LearnedAffineFit::samples_per_part;
        std::vector<int> samples(first, first + LearnedAffineFit::samples_per_part);
        std::ranges::sort(samples);
        samples.erase(std::unique(samples.begin(), samples.end()), samples.end());
        const AffineParts::Children children = part < tree.clusters()
                                                   ? tree.cluster_children(part)
                                                   : tree.block_children(part - tree.clusters());
        const std::vector<int> own = distinct(children);
        require_own(samples, own, part);
        if (part < tree.clusters()) {
            const auto first_of_box =
                fit_.box_samples.begin() + std::ptrdiff_t{part} * LearnedAffineFit::samples_per_box;
            require_own({first_of_box, first_of_box + LearnedAffineFit::samples_per_box}, own, part);
        }
        AffineParts::Children near;
        for (std::size_t k = 0; k < children.size(); ++k) near[k] = nearest(samples, children[k], fit_.X);
        maps_.add_map(children, near, samples, fit_.X);
        grid_.push_back(resolution(samples, fit_.X));
    }
}

ClusterSamples LearnedAffineModel::cluster_samples(int cluster, const float* x) const noexcept {
    constexpr auto count = std::size_t{LearnedAffineFit::samples_per_box};
    const int* places = box_places_.data() + count * static_cast<std::size_t>(cluster);
    const int last = 3 * (static_cast<int>(fit_.X.rows()) - 1);
    const auto point = [&](std::size_t i) -> Eigen::Array4f {
        const float* p = x + places[i];
        if (places[i] == last) return {p[0], p[1], p[2], 0};  // the array may end here
        return Eigen::Map<const Eigen::Array4f>(p);
    };
    // Offsets from the first sample keep their digits far from the origin.
    const Eigen::Array4f first = point(0);
    ClusterSamples result{{first, first}};
    Eigen::Array4f sum = Eigen::Array4f::Zero(), squares = sum;
    for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Array4f p = point(i), q = p - first;
        result.box.lo = result.box.lo.min(p);
        result.box.hi = result.box.hi.max(p);
        sum += q;
        squares += q * q;
    }
    result.box.lo[3] = result.box.hi[3] = 0;
    constexpr float share = 1 / static_cast<float>(count);
    const Eigen::Array4f squared = squares * share - (sum * share).square();
    result.spread = std::sqrt(std::max(squared[0] + squared[1] + squared[2], 0.f));
    return result;
}

float LearnedAffineModel::map_children(int part, const float* x, float* scratch,
                                       BoxPack& boxes) const noexcept {
    const AffinePart of_kernel = maps_.part(part);
    kernels().affine_map(of_kernel, maps_.rest_boxes(part), x, rounding, scratch, boxes, nullptr);
    // The kernel leaves there what the map leaves at the samples.
    const Eigen::Map<const Eigen::ArrayXf> left(scratch, 3 * of_kernel.count);
    return std::sqrt(left.square().sum() / static_cast<float>(of_kernel.count)) + grid_[part];
}

float LearnedAffineModel::cluster_score(int cluster, float spread) const noexcept {
    return fit_.clusters[cluster].ood_score(spread * spread);
}

void LearnedAffineModel::grow(int part, float margin, float residual, BoxPack& boxes) const noexcept {
    using Lanes = Eigen::Array<float, tree_width, 1>;
    const Lanes by =
        (Eigen::Map<const Lanes>(fit_.growth.data() + std::ptrdiff_t{part} * tree_width) + margin) * residual;
    for (int a = 0; a < 3; ++a) {
        Eigen::Map<Lanes>(boxes.lo[a]) -= by;
        Eigen::Map<Lanes>(boxes.hi[a]) += by;
    }
}

std::array<float, tree_width> LearnedAffineModel::protrusions(int part, const BoxPack& boxes,
                                                              const WideTree& tree,
                                                              const WideBoxes& exact) const noexcept {
    std::array<float, tree_width> result;
    result.fill(-std::numeric_limits<float>::infinity());
    const bool is_cluster = part < clusters();
    const int block = part - clusters();
    const int first = is_cluster ? tree.first_block[part] : tree_width * block;
    const int count = is_cluster ? tree.blocks_in(part) : int{tree.leaves_in[block]};
    const std::vector<Box>& children = is_cluster ? exact.blocks : exact.leaves;
    for (int k = 0; k < count; ++k) result[k] = outside(boxes.box(k), children[first + k]);
    return result;
}

void LearnedAffineModel::prefetch_samples(int cluster, const float* x) const noexcept {
    constexpr int count = LearnedAffineFit::samples_per_box;
    for (int i = count * cluster; i < count * (cluster + 1); ++i) prefetch_line(x + box_places_[i]);
}

std::size_t LearnedAffineModel::bytes() const noexcept {
    return maps_.bytes() + static_cast<std::size_t>(fit_.X.size()) * sizeof(float) +
           (fit_.samples.size() + 2 * fit_.box_samples.size()) * sizeof(int) +
           fit_.clusters.size() * sizeof(BoxFit) +
           (fit_.residual.size() + fit_.growth.size() + grid_.size()) * sizeof(float);
}

LearnedAffineBoxes::LearnedAffineBoxes(std::shared_ptr<const LearnedAffineModel> model, NodeMargins margins)
    : model_(std::move(model)), margins_(std::move(margins)) {}

float LearnedAffineBoxes::margin(int bound, float ood_score) noexcept {
    const std::size_t i = bound;
    if (margins_.limits.empty()) return margins_.margins[i];
    const float limit = margins_.limits[i];
    if (ood_score <= limit) return margins_.margins[i] * margin_weight(ood_score, limit);
    ++out_of_range_;  // a NaN score is out of range too
    return -1;
}

bool LearnedAffineBoxes::box(int cluster, Box& box) noexcept {
    const ClusterSamples samples = model_->cluster_samples(cluster, x_);
    met_non_finite_ |= !std::isfinite(samples.spread);
    const float by = margin(cluster, model_->cluster_score(cluster, samples.spread));
    if (by < 0) return false;
    const float growth = model_->fit().clusters[cluster].growth;
    const Eigen::Array4f outward = Eigen::Array4f(1, 1, 1, 0) * ((growth + by) * samples.spread);
    box = {samples.box.lo - outward, samples.box.hi + outward};
    return true;
}

bool LearnedAffineBoxes::children(int part, BoxPack& boxes) noexcept {
    const float residual = model_->map_children(part, x_, scratch_.data(), boxes);
    met_non_finite_ |= !std::isfinite(residual);
    const float by = margin(model_->clusters() + part, model_->part_score(part, residual));
    if (by < 0) return false;
    model_->grow(part, by, residual, boxes);
    return true;
}

}  // namespace nbd
