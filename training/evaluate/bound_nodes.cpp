#include "training/evaluate/bound_nodes.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "collision/tree/posed_tree.hpp"

namespace nbd {
namespace {

double inflation(double size, double exact) {
    return size / std::max(exact, double{std::numeric_limits<float>::min()}) - 1;
}

class SphereNodes final : public BoundNodes {
 public:
    SphereNodes(std::shared_ptr<const CollisionTree> tree, BoundKind kind, std::optional<float> margin)
        : posed_(std::move(tree), kind, margin) {}

    int levels() const override { return spheres().depth() + 1; }

    std::span<const BoundNode> pose(VerticesRef x, std::span<const Sphere> exact) override {
        posed_.begin_pose(VertexView::as_long_as(x));
        nodes_.clear();
        for (int i = 0; i < std::ssize(spheres().nodes); ++i) {
            const int exact_before = posed_.nodes_out_of_range();
            const Sphere& sphere = posed_.sphere(i);
            nodes_.push_back({.level = spheres().nodes[i].depth,
                              .bound = i,
                              .out_of_range = posed_.nodes_out_of_range() > exact_before,
                              .sphere = sphere,
                              .exact = exact[i],
                              .inflation = inflation(sphere.r, exact[i].r),
                              .vertices = std::ssize(spheres().node_vertices(i))});
        }
        return nodes_;
    }

    std::span<const long> outside(std::size_t i, VerticesRef x, std::span<const double> factors) override {
        const Sphere& sphere = nodes_[i].sphere;
        const std::span<const int> vertices = spheres().node_vertices(i);
        squared_.resize(vertices.size());
        for (std::size_t j = 0; j < vertices.size(); ++j)
            squared_[j] = (x.row(vertices[j]).transpose() - sphere.c).cast<double>().squaredNorm();
        counts_.clear();
        for (const double factor : factors) {
            const double r = sphere.r * factor;
            counts_.push_back((squared_.array() > r * r).count());
        }
        return counts_;
    }

 private:
    const SphereTree& spheres() const { return posed_.tree().spheres; }

    PosedTree posed_;
    std::vector<BoundNode> nodes_;
    Eigen::VectorXd squared_;  // distances of a node's vertices from the centre
    std::vector<long> counts_;
};

/// Length of a box's diagonal.
double diagonal(const Box& box) noexcept { return double{(box.hi - box.lo).matrix().norm()}; }

Sphere around(const Box& box) {
    return {((box.lo + box.hi) / 2).head<3>().matrix(), static_cast<float>(diagonal(box) / 2)};
}

class WideNodes final : public BoundNodes {
 public:
    WideNodes(const std::shared_ptr<const CollisionTree>& tree, std::optional<float> margin)
        : posed_(tree, BoundKind::learned_affine, margin),
          learned_(tree->learned_affine, node_margins(*tree, BoundKind::learned_affine, margin)) {}

    int levels() const override { return 3; }

    std::span<const BoundNode> pose(VerticesRef x, std::span<const Sphere> /*exact*/) override {
        // The boxes do not tell which of them are out of range, so they are asked for a second time.
        x_ = x;
        learned_.begin_pose(x_.data());
        posed_.begin_pose(x_);
        nodes_.clear();
        parts_.clear();
        PosedWideTree& boxes = posed_.wide_tree();
        const WideTree& tree = boxes.tree();
        fit_wide_boxes(tree, x, exact_);
        int bound = 0;
        for (int c = 0; c < tree.clusters(); ++c) {
            Box box;
            const bool in_range = learned_.box(c, box);
            add(0, bound++, in_range, boxes.cluster(c), exact_.clusters[c],
                {tree_width * tree.first_block[c], tree_width * tree.first_block[c + 1]});
        }
        BoxPack pack;
        for (int c = 0; c < tree.clusters(); ++c, ++bound) {
            const bool in_range = learned_.blocks(c, pack);
            for (int k = 0; k < tree.blocks_in(c); ++k) {
                const int block = tree.first_block[c] + k;
                add(1, bound, in_range, boxes.blocks(c).boxes.box(k), exact_.blocks[block],
                    {tree_width * block, tree_width * (block + 1)});
            }
        }
        for (int b = 0; b < tree.blocks(); ++b, ++bound) {
            const bool in_range = learned_.leaves(b, pack);
            for (int k = 0; k < tree.leaves_in[b]; ++k) {
                const int leaf = tree_width * b + k;
                add(2, bound, in_range, boxes.leaves(b).boxes.box(k), exact_.leaves[leaf], {leaf, leaf + 1});
            }
        }
        return nodes_;
    }

    std::span<const long> outside(std::size_t i, VerticesRef x, std::span<const double> factors) override {
        const Box& box = parts_[i].box;
        const Eigen::Array4f c = (box.lo + box.hi) / 2, half = (box.hi - box.lo) / 2;
        counts_.clear();
        for (const double factor : factors) {
            const Eigen::Array4f grown = half * static_cast<float>(factor);
            counts_.push_back(outside(parts_[i], factor == 1 ? box : Box{c - grown, c + grown}, x));
        }
        return counts_;
    }

 private:
    struct Leaves {
        int begin = 0, end = 0;
    };
    struct Part {
        Box box, exact;
        Leaves leaves;
    };

    const WideTree& tree() { return posed_.wide_tree().tree(); }

    void add(int level, int bound, bool in_range, const Box& box, const Box& exact, Leaves leaves) {
        long vertices = 0;
        for (int i = leaves.begin; i < leaves.end; ++i) vertices += std::ssize(tree().leaf_vertices(i));
        nodes_.push_back({.level = level,
                          .bound = bound,
                          .out_of_range = !in_range,
                          .sphere = around(box),
                          .exact = around(exact),
                          .inflation = inflation(diagonal(box), diagonal(exact)),
                          .vertices = vertices});
        parts_.push_back({box, exact, leaves});
    }

    long outside(const Part& part, const Box& box, VerticesRef x) {
        if (!(nbd::outside(box, part.exact) > 0)) return 0;
        long count = 0;
        for (int i = part.leaves.begin; i < part.leaves.end; ++i)
            for (const int v : tree().leaf_vertices(i)) {
                const Eigen::Array3f p = x.row(v).transpose();
                count += !((p >= box.lo.head<3>()).all() && (p <= box.hi.head<3>()).all());
            }
        return count;
    }

    PosedTree posed_;
    LearnedAffineBoxes learned_;  // the same, to ask which are out of range
    Vertices x_;                  // of the pose
    WideBoxes exact_;
    std::vector<BoundNode> nodes_;
    std::vector<Part> parts_;  // of the nodes
    std::vector<long> counts_;
};

}  // namespace

std::unique_ptr<BoundNodes> bound_nodes(std::shared_ptr<const CollisionTree> tree, BoundKind kind,
                                        std::optional<float> margin) {
    if (kind == BoundKind::learned_affine) return std::make_unique<WideNodes>(tree, margin);
    return std::make_unique<SphereNodes>(std::move(tree), kind, margin);
}

void exact_spheres(const SphereTree& tree, VerticesRef x, std::vector<Sphere>& spheres) {
    spheres.clear();
    for (int i = 0; i < std::ssize(tree.nodes); ++i)
        spheres.push_back(bounding_sphere(x, tree.node_vertices(i)));
}

}  // namespace nbd
