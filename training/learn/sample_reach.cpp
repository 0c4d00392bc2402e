#include "training/learn/sample_reach.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/base/counter_random.hpp"
#include "collision/bounds/learned/learned_boxes.hpp"
#include "collision/geometry/bounding_sphere.hpp"

namespace nbd {

namespace {

/// Computes the boxes of all nodes in a pose, from the leaves up.
void fit_boxes(const SphereTree& tree, const Vertices& x, std::vector<Box>& boxes) {
    boxes.assign(tree.nodes.size(), empty_box());
    for (std::size_t i = tree.nodes.size(); i-- > 0;) {
        const SphereTree::Node& node = tree.nodes[i];
        if (node.is_leaf()) {
            for (const int v : tree.node_vertices(static_cast<int>(i))) {
                const Eigen::Array4f p(x(v, 0), x(v, 1), x(v, 2), 0);
                boxes[i] = joined(boxes[i], {p, p});
            }
        } else {
            const auto child = static_cast<std::size_t>(node.first_child);
            boxes[i] = joined(boxes[child], boxes[child + 1]);
        }
    }
}

float largest_distance(VerticesRef x, std::span<const int> vertices, const Eigen::Vector3f& c) {
    float squared = 0;
    for (const int v : vertices) squared = std::max(squared, (x.row(v).transpose() - c).squaredNorm());
    return std::sqrt(squared);
}

}  // namespace

SampleReach measure_reach(const SphereTree& tree, const LearnedModel& model, FrameSource& source,
                          std::span<const FrameId> frames, std::uint64_t seed, bool with_samples) {
    const auto poses = static_cast<Eigen::Index>(frames.size());
    const auto nodes = static_cast<Eigen::Index>(tree.nodes.size());
    SampleReach reach;
    for (PoseRows* rows : {&reach.distance, &reach.growth, &reach.box, &reach.spread, &reach.exact})
        rows->resize(poses, nodes);
    if (with_samples)
        for (const LearnedModel::Node& node : model.nodes)
            reach.samples.emplace_back(poses, node.exact ? 0 : node.sample_count);
    struct Scratch {
        Vertices turned;
        std::vector<Box> boxes;
        Eigen::ArrayXd sum, square_sum;  // [samples] of squared distances so far
    };
    const auto all_samples = static_cast<Eigen::Index>(model.samples.size());
    std::vector<Scratch> scratch(frame_slots);
    for (Scratch& s : scratch) s.sum = s.square_sum = Eigen::ArrayXd::Zero(all_samples);
    source.for_each_frame(frames, [&](int slot, int index, VerticesRef x) {
        auto& [turned, boxes, sum, square_sum] = scratch[static_cast<std::size_t>(slot)];
        const auto& f = frames[static_cast<std::size_t>(index)];
        const auto stream =
            static_cast<std::uint64_t>(f.trajectory) << 32 | static_cast<std::uint64_t>(f.frame);
        turned = x * CounterRandom(seed, stream).orientation().toRotationMatrix().cast<float>();
        fit_boxes(tree, turned, boxes);
        const Positions positions(VertexView::as_long_as(x));
        for (Eigen::Index i = 0; i < nodes; ++i) {
            const int node = static_cast<int>(i);
            const std::span<const int> vertices = tree.node_vertices(node);
            const LearnedModel::Node& n = model.nodes[static_cast<std::size_t>(i)];
            const std::span<const int> samples = model.node_samples(node);
            const Eigen::Vector3f c = learned_sphere(model, node, positions).sphere.c;
            reach.distance(index, i) = largest_distance(x, samples, c);
            reach.exact(index, i) = bounding_sphere(x, vertices).r;
            reach.growth(index, i) = largest_distance(x, vertices, c) - reach.distance(index, i);
            const SampleBox seen = sample_box(model, node, turned);
            reach.box(index, i) = outside(seen.box, boxes[static_cast<std::size_t>(i)]) /
                                  std::max(seen.spread, std::numeric_limits<float>::min());
            reach.spread(index, i) = seen.spread;
            for (Eigen::Index k = 0; k < n.sample_count; ++k) {
                const float squared =
                    (x.row(samples[static_cast<std::size_t>(k)]).transpose() - c).squaredNorm();
                const Eigen::Index sample = n.sample_begin + k;
                sum[sample] += double{squared};
                square_sum[sample] += double{squared} * double{squared};
                if (with_samples && !n.exact)
                    reach.samples[static_cast<std::size_t>(i)](index, k) = std::sqrt(squared);
            }
        }
    });
    Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(all_samples), square_sum = sum;
    for (const Scratch& s : scratch) {
        sum += s.sum;
        square_sum += s.square_sum;
    }
    const double count = std::max<double>(1, static_cast<double>(poses));
    reach.squared_mean = sum / count;
    reach.squared_deviation = (square_sum / count - reach.squared_mean.square()).max(0).sqrt();
    return reach;
}

}  // namespace nbd
