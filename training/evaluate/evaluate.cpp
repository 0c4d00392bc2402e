#include "training/evaluate/evaluate.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <variant>

#include "collision/geometry/bounding_sphere.hpp"
#include "collision/tree/posed_tree.hpp"
#include "training/evaluate/wide_coverage.hpp"
#include "training/files/recording_hash.hpp"

namespace nbd {

namespace {

/// Sums of one bound over frames; the rows are their means.
struct Sums {
    Eigen::ArrayXXd radius_error, inflation;                              // [margins, depths]
    Eigen::ArrayXd centre_error;                                          // [depths]
    Eigen::Array<long, Eigen::Dynamic, Eigen::Dynamic> outside, missing;  // [margins, depths]
    Eigen::Array<long, Eigen::Dynamic, 1> nodes, vertices;                // [depths]

    Sums(Eigen::Index margins, Eigen::Index depths)
        : radius_error(Eigen::ArrayXXd::Zero(margins, depths)),
          inflation(radius_error),
          centre_error(Eigen::ArrayXd::Zero(depths)),
          outside(decltype(outside)::Zero(margins, depths)),
          missing(decltype(missing)::Zero(margins, depths)),
          nodes(decltype(nodes)::Zero(depths)),
          vertices(nodes) {}

    void operator+=(const Sums& other) {
        radius_error += other.radius_error;
        inflation += other.inflation;
        centre_error += other.centre_error;
        outside += other.outside;
        missing += other.missing;
        nodes += other.nodes;
        vertices += other.vertices;
    }

    /// Adds a node of so many vertices. s, truth: its bound and the exact one. outside(k, factor): vertices
    /// outside of the bound times this factor, for the k-th margin.
    template <class Outside>
    void add_node(Eigen::Index depth, std::size_t vertex_count, const Sphere& s, const Sphere& truth,
                  const std::vector<double>& margins, const Outside& count_outside) {
        const double size = std::max(truth.r, std::numeric_limits<float>::min());
        ++nodes[depth];
        vertices[depth] += static_cast<long>(vertex_count);
        centre_error[depth] += static_cast<double>((s.c - truth.c).norm()) / size;
        for (std::size_t k = 0; k < margins.size(); ++k) {
            const Eigen::Index row = k;
            const double r = static_cast<double>(s.r) * (1 + margins[k]);
            const long lost = count_outside(r, 1 + margins[k]);
            inflation(row, depth) += (r - static_cast<double>(truth.r)) / size;
            radius_error(row, depth) += std::abs(r - static_cast<double>(truth.r)) / size;
            outside(row, depth) += lost;
            missing(row, depth) += lost > 0;
        }
    }
};

/// Spheres of the tree in a pose, and their sums, per slot of the stream.
class SphereProbe {
 public:
    SphereProbe(const std::shared_ptr<const CollisionTree>& tree, BoundKind kind) : posed_(tree, kind, 0.f) {}

    void add_frame(VerticesRef x, const std::vector<Sphere>& exact, const std::vector<double>& margins,
                   Sums& sums) {
        posed_.begin_pose(VertexView::as_long_as(x));
        const SphereTree& tree = posed_.tree().spheres;
        for (int i = 0; i < std::ssize(tree.nodes); ++i) {
            const Sphere s = posed_.sphere(i);
            const std::span<const int> vertices = tree.node_vertices(i);
            squared_.resize(vertices.size());
            for (std::size_t j = 0; j < vertices.size(); ++j)
                squared_[j] = (x.row(vertices[j]).transpose() - s.c).cast<double>().squaredNorm();
            sums.add_node(tree.nodes[i].depth, vertices.size(), s, exact[i], margins,
                          [&](double r, double) { return (squared_.array() > r * r).count(); });
        }
    }

 private:
    PosedTree posed_;
    Eigen::VectorXd squared_;  // scratch: distances of a node's vertices from the centre
};

/// The sphere around a box.
Sphere around(const Box& box) {
    return {((box.lo + box.hi) / 2).head<3>().matrix(), static_cast<float>(diagonal(box) / 2)};
}

/// Likewise of `learned_affine` boxes, whose radius is half their diagonal; a margin scales a box about its
/// centre.
class BoxProbe {
 public:
    explicit BoxProbe(const CollisionTree& tree)
        : nodes_(tree, node_margins(tree, BoundKind::learned_affine, 0.f)) {}

    void add_frame(VerticesRef x, const std::vector<double>& margins, Sums& sums) {
        for (const WideNode& node : nodes_.pose(x)) {
            const Eigen::Array4f c = (node.box.lo + node.box.hi) / 2, half = (node.box.hi - node.box.lo) / 2;
            sums.add_node(node.level, nodes_.vertices(node), around(node.box), around(node.exact), margins,
                          [&](double, double factor) {
                              if (factor == 1) return nodes_.outside(node, node.box, x);
                              const Eigen::Array4f grown = half * static_cast<float>(factor);
                              return nodes_.outside(node, {c - grown, c + grown}, x);
                          });
        }
    }

 private:
    WideNodes nodes_;
};

/// One bound and its sums, per slot of the stream.
struct Probe {
    BoundKind kind;
    Sums sums;
    std::variant<SphereProbe, BoxProbe> bounds;

    Probe(const std::shared_ptr<const CollisionTree>& tree, BoundKind bound, Eigen::Index margins)
        : kind(bound), sums(margins, levels(*tree, bound)), bounds(make(tree, bound)) {}

    static Eigen::Index levels(const CollisionTree& tree, BoundKind kind) {
        return kind == BoundKind::learned_affine ? WideNodes::levels : tree.spheres.depth() + 1;
    }
    static std::variant<SphereProbe, BoxProbe> make(const std::shared_ptr<const CollisionTree>& tree,
                                                    BoundKind kind) {
        if (kind == BoundKind::learned_affine) return BoxProbe(*tree);
        return SphereProbe(tree, kind);
    }
};

void check(const SurfaceBody& body, const CollisionTree& tree, std::span<const FrameId> frames,
           const std::string& name, const EvaluateConfig& config) {
    if (config.margins.empty()) throw std::invalid_argument("no margins to evaluate");
    for (const double margin : config.margins)
        if (!(margin >= 0 && std::isfinite(margin)))
            throw std::invalid_argument(fmt::format("margin {}; allowed: 0 or more", margin));
    if (config.max_frames < 0)
        throw std::invalid_argument(fmt::format("max_frames is {}; allowed: 0 or more", config.max_frames));
    if (frames.empty()) throw std::invalid_argument(fmt::format("{}: no frames to evaluate", name));
    if (tree.vertex_count != body.X.rows())
        throw std::invalid_argument(fmt::format("the tree has {} vertices, but the body's surface has {}",
                                                tree.vertex_count, body.X.rows()));
}

void check_bounds(const CollisionTree& tree, const EvaluateConfig& config) {
    std::vector<std::string_view> names;
    for (const BoundKind kind : config.bounds) names.push_back(name(kind));
    if (std::ranges::find(config.bounds, BoundKind::affine) != config.bounds.end())
        throw std::invalid_argument(
            "affine bounds are not those of the tree's nodes, which are evaluated; `nbdtree coverage` "
            "measures "
            "them");
    if (std::ranges::none_of(config.bounds, [&](BoundKind kind) { return has_bounds(tree, kind); }))
        throw std::invalid_argument(fmt::format("the tree has no {} bounds", fmt::join(names, ", ")));
}

}  // namespace

std::vector<EvaluationRow> evaluate_frames(const SurfaceBody& body,
                                           const std::shared_ptr<const CollisionTree>& tree,
                                           const RecordingReader& recording, std::span<const FrameId> frames,
                                           const std::string& name, const EvaluateConfig& config) {
    check(body, *tree, frames, name, config);
    const std::vector<FrameId> chosen =
        spread(frames, config.max_frames > 0 ? config.max_frames : std::numeric_limits<int>::max());
    const SphereTree& spheres = tree->spheres;
    const Eigen::Index margins = config.margins.size();

    std::vector<std::vector<Probe>> probes(frame_slots);
    std::vector<std::vector<Sphere>> exact(frame_slots);
    for (auto& slot : probes)
        for (const BoundKind kind : config.bounds)
            if (has_bounds(*tree, kind)) slot.emplace_back(tree, kind, margins);
    for_each_pose(body, recording, chosen, [&](int slot, int, VerticesRef x, VerticesRef) {
        std::vector<Sphere>& truth = exact[slot];
        truth.clear();
        for (int i = 0; i < std::ssize(spheres.nodes); ++i)
            truth.push_back(bounding_sphere(x, spheres.node_vertices(i)));
        for (Probe& probe : probes[slot])
            if (auto* boxes = std::get_if<BoxProbe>(&probe.bounds))
                boxes->add_frame(x, config.margins, probe.sums);
            else
                std::get<SphereProbe>(probe.bounds).add_frame(x, truth, config.margins, probe.sums);
    });

    const long poses = chosen.size();
    std::vector<EvaluationRow> rows;
    for (std::size_t b = 0; b < probes.front().size(); ++b) {
        const BoundKind kind = probes.front()[b].kind;
        const Eigen::Index depths = Probe::levels(*tree, kind);
        Sums sums(margins, depths);
        for (const auto& slot : probes) sums += slot[b].sums;
        for (Eigen::Index k = 0; k < margins; ++k)
            for (Eigen::Index d = 0; d < depths; ++d) {
                const long all_nodes = sums.nodes[d], all_vertices = sums.vertices[d];
                const auto per_node = 1 / static_cast<double>(all_nodes);
                rows.push_back({.frames = name,
                                .bound = kind,
                                .depth = static_cast<int>(d),
                                .margin = config.margins[k],
                                .radius_error = sums.radius_error(k, d) * per_node,
                                .inflation = sums.inflation(k, d) * per_node,
                                .centre_error = sums.centre_error[d] * per_node,
                                .vertices_outside = static_cast<double>(sums.outside(k, d)) /
                                                    static_cast<double>(all_vertices),
                                .nodes_missing = static_cast<double>(sums.missing(k, d)) * per_node,
                                .poses = poses,
                                .nodes = all_nodes,
                                .vertices = all_vertices});
            }
    }
    return rows;
}

std::vector<TestFrames> test_frames(const TreeFile& file, const RecordingReader& recording) {
    check_recording(file.facts.body_hash, file.W.cols(), recording);
    std::vector<TestFrames> sets;
    const RecordingHash hashes = hash_recording(recording);
    const TrainingFacts& facts = file.facts;
    const bool own =
        hashes.hex == facts.recording_hash || recording.label("remapped_from_sha256") == facts.recording_hash;
    if (own) {
        sets.push_back({"random frames", frames_of(recording, facts.split, FrameSet::random_test)});
        sets.push_back({"held-out trajectories", frames_of(recording, facts.split, FrameSet::held_out)});
    } else {
        sets.push_back({"other recording", complete_frames(recording)});
        if (!facts.trained_on) tell_unknown(recording);
    }
    // Of its own recording, the split keeps out what training saw, and calibration may have seen more since.
    std::vector<const SeenTrajectories*> seen;
    if (facts.trained_on && !own) seen.push_back(&*facts.trained_on);
    if (facts.calibrated_on) seen.push_back(&*facts.calibrated_on);
    std::vector<int> left_out = known_trajectories(recording, hashes, seen);
    const auto is_left_out = [&](const FrameId& frame) {
        return std::ranges::binary_search(left_out, recording.trajectories()[frame.trajectory].id);
    };
    std::vector<int> told;
    for (const FrameId& frame : sets.back().frames)
        if (const int id = recording.trajectories()[frame.trajectory].id;
            is_left_out(frame) && (told.empty() || told.back() != id))
            told.push_back(id);
    tell_left_out(recording, told, "trained or calibrated on");
    std::erase_if(sets.back().frames, is_left_out);
    std::erase_if(sets, [](const TestFrames& set) { return set.frames.empty(); });
    if (sets.empty())
        throw std::runtime_error(fmt::format(
            "{}: no frames to test on; training and calibration saw all of them", recording.path().string()));
    return sets;
}

std::vector<EvaluationRow> evaluate(const TreeFile& file, const RecordingReader& recording,
                                    const EvaluateConfig& config) {
    check_bounds(file.tree, config);
    const SurfaceBody body = surface_body(file);
    const auto tree = refer_to(file.tree);
    std::vector<EvaluationRow> rows;
    for (const TestFrames& set : test_frames(file, recording)) {
        const auto more = evaluate_frames(body, tree, recording, set.frames, set.name, config);
        rows.insert(rows.end(), more.begin(), more.end());
    }
    return rows;
}

std::string to_csv(const std::vector<EvaluationRow>& rows) {
    std::string text =
        "frames,bound,margin,depth,radius_error,inflation,centre_error,vertices_outside,nodes_missing,"
        "poses,nodes,vertices\n";
    for (const EvaluationRow& r : rows)
        text += fmt::format("{},{},{},{},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{},{},{}\n", r.frames,
                            name(r.bound), r.margin, r.depth, r.radius_error, r.inflation, r.centre_error,
                            r.vertices_outside, r.nodes_missing, r.poses, r.nodes, r.vertices);
    return text;
}

std::string to_text(const std::vector<EvaluationRow>& rows, bool all_depths) {
    const auto same_block = [](const EvaluationRow& a, const EvaluationRow& b) {
        return a.frames == b.frames && a.bound == b.bound;
    };
    std::string text;
    for (auto begin = rows.begin(); begin != rows.end();) {
        const auto end =
            std::find_if(begin, rows.end(), [&](const EvaluationRow& r) { return !same_block(r, *begin); });
        // Rows of a block come by margin, then by depth.
        const auto depths =
            std::count_if(begin, end, [&](const EvaluationRow& r) { return r.margin == begin->margin; });
        text += fmt::format("{}{}, {} poses, {} bounds; % at margins of", text.empty() ? "" : "\n",
                            begin->frames, begin->poses, name(begin->bound));
        for (auto r = begin; r < end; r += depths) text += fmt::format(" {:g}", 100 * r->margin);
        const auto width = static_cast<int>(9 * ((end - begin) / depths));
        text += fmt::format(" %\n  depth  radius error  inflation  centre error  {:<{}}  nodes that miss\n",
                            "vertices outside", width);
        for (auto first = begin; first < begin + depths; ++first) {
            const auto row = first - begin;
            if (!all_depths && row != 0 && row != depths / 2 && row != depths - 1) continue;
            text += fmt::format("  {:5}  {:12.3f}  {:9.3f}  {:12.3f}  ", first->depth,
                                100 * first->radius_error, 100 * first->inflation, 100 * first->centre_error);
            for (auto r = first; r < end; r += depths)
                text += fmt::format("{:<9.4f}", 100 * r->vertices_outside);
            text += "  ";
            for (auto r = first; r < end; r += depths)
                text += fmt::format("{:<8.2f}", 100 * r->nodes_missing);
            text.erase(text.find_last_not_of(' ') + 1);
            text += '\n';
        }
        begin = end;
    }
    return text;
}

}  // namespace nbd
