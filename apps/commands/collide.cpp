#include <fmt/core.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/commands/commands.hpp"
#include "apps/source/pose_argument.hpp"
#include "apps/view/make_view.hpp"
#include "apps/view/page.hpp"
#include "collision/geometry/triangle_triangle.hpp"
#include "collision/query/pair_query.hpp"
#include "meshing/h5/atomic_file.hpp"
#include "meshing/surface/solid_boundary.hpp"

namespace nbd {
namespace {

struct CollideArguments {
    std::string a, b, pairs, page, bounds = "auto";
    std::optional<float> margin;
    float distance = -1;
};

PosedTree posed(const PoseArgument& surface, BoundKind asked, std::optional<float> margin) {
    const BoundKind kind = bounds_for(surface, asked);
    const bool takes_margin = surface.from_tree || kind == BoundKind::exact;
    PosedTree tree(surface.tree, kind, takes_margin ? margin : std::nullopt);
    if (tree.takes_nodes() && surface.nodes.rows() > 0)
        tree.begin_pose_of_nodes(surface.nodes);
    else
        tree.begin_pose(surface.x);
    return tree;
}

Triangle triangle(const PoseArgument& surface, int face) {
    const auto corner = [&](int c) -> Eigen::Vector3f { return surface.x.row(surface.tree->faces(face, c)); };
    return {corner(0), corner(1), corner(2)};
}

std::string chosen(const PosedTree& a, const PosedTree& b) {
    const std::string_view in_a = name(a.chosen()), in_b = name(b.chosen());
    return in_a == in_b ? std::string(in_a) : fmt::format("{} and {}", in_a, in_b);
}

/// What lies within the other surface, a in b and b in a; none where faces meet.
std::pair<Containment, Containment> containments(const PoseArgument& a, const PoseArgument& b,
                                                 std::span<const FacePair> pairs) {
    const TriMesh in_a{a.x.cast<double>(), a.tree->faces}, in_b{b.x.cast<double>(), b.tree->faces};
    // Near pairs need not meet: only intersecting ones say that neither surface can lie within the other.
    for (const FacePair& pair : pairs)
        if (triangles_intersect(triangle(a, pair.a), triangle(b, pair.b))) return {};
    return {containment(in_a, in_b), containment(in_b, in_a)};
}

const char* in_json(Containment found) {
    return found == Containment::whole ? "whole" : found == Containment::some_parts ? "parts" : "no";
}

void tell_containment(const std::string& inner, const std::string& outer, Containment found,
                      const Output& out) {
    if (found != Containment::none)
        out.text(fmt::format("{}{} lies inside {}", found == Containment::whole ? "" : "a part of ", inner,
                             outer));
}

void write_view(const CollideArguments& arguments, const PoseArgument& a, const PoseArgument& b,
                BoundKind bounds) {
    const std::string title = fmt::format("{} and {}{}", arguments.a, arguments.b, from_origin(a.origin));
    const ViewScene scene = view_of_surfaces({view_source(arguments.a, a, bounds, arguments.margin),
                                              view_source(arguments.b, b, bounds, arguments.margin)},
                                             {a.x, b.x}, title, std::max(arguments.distance, 0.f));
    h5::AtomicFile file(arguments.page);
    write_page(file.out(), scene);
    file.commit();
}

void run(const CollideArguments& arguments, Output& out) {
    check_outputs({{"pairs", arguments.pairs, ".csv"}, {"view", arguments.page, ".html"}},
                  {arguments.a, arguments.b});
    out.work("colliding");
    const BoundKind bounds = bound_kind(arguments.bounds);
    PoseArgument a = read_pose(arguments.a, bounds), b = read_pose(arguments.b, bounds);
    check_model_of({&a, &b}, bounds, arguments.margin.has_value());
    const Eigen::Vector3d origin = count_from_common_origin({&a, &b});
    PosedTree tree_a = posed(a, bounds, arguments.margin), tree_b = posed(b, bounds, arguments.margin);
    PairQuery query;
    const std::span<const FacePair> pairs = arguments.distance < 0
                                                ? query.intersecting(tree_a, tree_b)
                                                : query.within(tree_a, tree_b, arguments.distance);
    if (!arguments.pairs.empty()) {
        h5::AtomicFile file(arguments.pairs);
        file.out() << "face_a,face_b\n";
        for (const FacePair& pair : pairs) file.out() << pair.a << ',' << pair.b << '\n';
        file.commit();
    }
    const QueryCounters& count = query.counters();
    out.text(fmt::format(
        "{} face pairs {}, found with {} bounds; {} nodes bounded, {} of them exactly as their input was out "
        "of range, {} leaf pairs, {} triangle tests",
        pairs.size(), arguments.distance < 0 ? "intersect" : fmt::format("within {:g} m", arguments.distance),
        chosen(tree_a, tree_b), count.nodes_bounded, count.nodes_out_of_range, count.leaf_pairs,
        count.triangle_tests));
    const auto [a_in_b, b_in_a] = containments(a, b, pairs);
    tell_containment(arguments.a, arguments.b, a_in_b, out);
    tell_containment(arguments.b, arguments.a, b_in_a, out);
    if (!origin.isZero(0))
        out.text(fmt::format("far from zero: positions are counted from ({}, {}, {})", origin.x(), origin.y(),
                             origin.z()));
    out.result({{"face_pairs", pairs.size()},
                {"a_in_b", in_json(a_in_b)},
                {"b_in_a", in_json(b_in_a)},
                {"origin", {origin.x(), origin.y(), origin.z()}},
                {"bounds", {name(tree_a.chosen()), name(tree_b.chosen())}},
                {"nodes_bounded", count.nodes_bounded},
                {"nodes_out_of_range", count.nodes_out_of_range},
                {"node_tests", count.node_tests},
                {"leaf_pairs", count.leaf_pairs},
                {"box_tests", count.box_tests},
                {"triangle_tests", count.triangle_tests}});
    if (!arguments.page.empty()) write_view(arguments, a, b, bounds);
}

}  // namespace

void add_collide(CLI::App& app, Output& out) {
    const auto [command, arguments] =
        add_command<CollideArguments>(app, out, "collide", "Finds the faces of two surfaces that touch", run);
    command.footer(
        "A and B: a surface file (with boxes as bounds, or exact spheres beside spheres), or TREE.h5@POSE,\n"
        "where POSE is a surface file with the tree's faces or RECORDING.h5:trajectory:frame.");
    command.add_option("A", arguments.a, "First surface")->required();
    command.add_option("B", arguments.b, "Second surface")->required();
    command
        .add_option("--bounds", arguments.bounds,
                    "Bounds of surfaces given as TREE.h5@POSE; surface files can have exact and boxes")
        ->check(bounds_name());
    command
        .add_option("--margin", arguments.margin,
                    "Share added to all radii, with no exact spheres out of range; default: as the "
                    "tree was calibrated")
        ->check(between(0, 10));
    command
        .add_option("--within", arguments.distance,
                    "Report faces at most this far apart (metres), not only touching ones")
        ->check(not_negative());
    command.add_option("--pairs", arguments.pairs,
                       "File for the pairs face_a,face_b (CSV): 0-based, in the files' face order, sorted");
    command.add_option("--view", arguments.page,
                       "Page (HTML) that shows both surfaces in a browser, with these faces marked");
}

}  // namespace nbd
