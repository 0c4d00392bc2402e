#include "apps/simulate/simulation_outputs.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <map>
#include <memory>
#include <utility>

#include "apps/cli/output_paths.hpp"
#include "apps/simulate/run_files.hpp"
#include "collision/base/notice.hpp"
#include "collision/base/temporary_files.hpp"
#include "collision/geometry/far_origin.hpp"
#include "meshing/formats/write_surface.hpp"
#include "sim/fem/stress.hpp"

namespace nbd {
namespace {

/// Path of a file as seen from the folder of another one.
std::string relative_to(const std::filesystem::path& from, const std::filesystem::path& file) {
    const std::filesystem::path folder = std::filesystem::absolute(from).parent_path();
    return std::filesystem::absolute(file)
        .lexically_normal()
        .lexically_relative(folder.lexically_normal())
        .generic_string();
}

/// Of all bodies of a world, each with a trajectory of its number. Copies of a body share a surface.
ContactEdgeFinder contact_edge_finder(const World& world) {
    std::map<const ContactShape*, std::shared_ptr<const ContactEdgeSurface>> made;
    std::vector<std::shared_ptr<const ContactEdgeSurface>> surfaces;
    std::vector<int> ids;
    for (int b = 0; b < world.body_count(); ++b) {
        const ContactShape& shape = world.shape(b);
        auto& shared = made[&shape];
        if (!shared) {
            const Vertices rest = embedded(shape.W, world.elastic(b).rest().X).cast<float>();
            shared = std::make_shared<const ContactEdgeSurface>(
                shared_exact_tree(rest, shape.F), shape.W.cast<float>(), rest,
                ContactDistances{world.thickness(), std::min(world.thickness(), mean_edge(shape))});
        }
        surfaces.push_back(shared);
        ids.push_back(b);
    }
    return {std::move(surfaces), std::move(ids), {world.obstacles().begin(), world.obstacles().end()}};
}

}  // namespace

std::string body_file_name(std::size_t body, std::string name) {
    // Bytes of letters beyond ASCII stay, as file systems take them.
    std::ranges::replace_if(
        name, [](unsigned char c) { return c < 0x80 && !std::isalnum(c) && c != '-' && c != '_'; }, '_');
    std::size_t end = std::min<std::size_t>(name.size(), 100);
    while (end < name.size() && end > 0 && (static_cast<unsigned char>(name[end]) & 0xC0u) == 0x80u) --end;
    return fmt::format("{}_{}", body, name.substr(0, end));
}

SimulationOutputs::SimulationOutputs(const SceneOutput& paths, const SceneSpec& spec, const World& world,
                                     const std::vector<std::string>& body_hashes,
                                     const RecordingExtras& extras)
    : paths_(paths),
      spec_(spec),
      world_(world),
      recording_(paths.recording, world.origin()),
      extras_(extras.of_frames),
      film_(spec, world.obstacles(), 6),
      table_(paths.csv.empty() ? StepTable() : StepTable(paths.csv)) {
    if (!paths.reactions.empty()) reactions_.emplace(paths.reactions, spec);
    if (!extras.scene_file.empty())
        recording_.label(scene_file_label, relative_to(paths.recording, extras.scene_file));
    if (!extras.options.empty()) recording_.label(run_options_label, extras.options);
    if (extras_.contact_edges) contact_edges_.emplace(contact_edge_finder(world));
    TrajectoryInfo info{.seed = spec.seed, .body_hash = {}, .recipe = spec.text, .failure = {}};
    for (int b = 0; b < world.body_count(); ++b) {
        const std::size_t i = b;
        info.id = b;
        info.body_hash = body_hashes[i];
        FrameContents contents{.tets = world.elastic(b).point_count(), .fields = extras_.fields};
        if (contact_edges_) contents.contact_edges = contact_edges_->distances(i);
        handles_.push_back(recording_.begin_trajectory(info, world.elastic(b).node_count(), contents));
        start_.push_back(world.state(b).x);
        names_.push_back(body_file_name(i, spec.bodies[i].name));
        const ContactShape& shape = world.shape(b);
        labels_.push_back(fmt::format("{}: body {} ({})", paths.recording.string(), b, spec.bodies[i].name));
        edges_.push_back(mean_edge(embedded(shape.W, world.elastic(b).rest().X), shape.F));
    }
    if (!paths.vtu.empty()) {
        remove_abandoned(paths.vtu / "scene");
        vtu_.emplace(paths.vtu, "scene");
    }
    if (!paths.obj.empty()) {
        for (const std::string& name : names_) remove_abandoned(paths.obj / name);
        make_folder(paths.obj);
    }
}

void SimulationOutputs::add_steps(const std::vector<StepRow>& steps,
                                  const std::vector<StepReactions>& reactions) {
    table_.add(steps);
    const std::vector<RecordedReaction> rows = recorded(spec_, reactions);
    recording_.add_reactions(rows);
    if (reactions_) reactions_->add(rows);
}

void SimulationOutputs::add_frame(const SimulationFrame& frame) {
    add_steps(frame.steps, frame.reactions);
    add_to_recording(frame);
    if (vtu_) add_vtu(frame);
    if (!paths_.obj.empty() || (!paths_.picture.empty() && film_.wants(frame.number))) add_surfaces(frame);
}

void SimulationOutputs::add_to_recording(const SimulationFrame& frame) {
    std::vector<Vertices> nodes;
    for (const BodyState& body : frame.world.bodies) nodes.push_back(body.x.cast<float>());
    std::vector<std::vector<ContactEdge>> edges(handles_.size());
    if (contact_edges_) edges = contact_edges_->find(nodes, frame.world.time);
    for (std::size_t b = 0; b < handles_.size(); ++b) {
        FrameExtras extras;
        add_fields(extras_, world_.elastic(b), frame.world.bodies[b].x, frame.contact_forces[b], extras);
        extras.contact_edges = std::move(edges[b]);
        recording_.add_frame(handles_[b], frame.world.time, nodes[b], extras);
        tell_rounding(b, nodes[b]);
    }
    troubled_.push_back(
        std::ranges::count_if(frame.steps, [](const StepRow& step) { return spoils_pose(step.trouble); }));
}

/// Tells once of a body that a step of float32 at its positions is more than a thousandth of its mean edge.
void SimulationOutputs::tell_rounding(std::size_t body, VerticesRef nodes) {
    const double farthest = nodes.cwiseAbs().maxCoeff(), step = float_step(farthest);
    if (!(1000 * step > edges_[body])) return;
    notice(
        fmt::format("{} is {:.4g} m away from the recording's origin, where positions are rounded to {:.2g} "
                    "m, more than a thousandth of its mean edge ({:.2g} m): its recorded shape is coarse; "
                    "record far parts of a scene apart",
                    labels_[body], farthest, step, edges_[body]));
    edges_[body] = std::numeric_limits<double>::infinity();
}

void SimulationOutputs::add_vtu(const SimulationFrame& frame) {
    std::vector<Eigen::VectorXd> stresses;
    std::vector<VtuBody> grids;
    stresses.reserve(start_.size());
    for (std::size_t b = 0; b < start_.size(); ++b) {
        const ElasticBody& elastic = world_.elastic(b);
        const BodyState& state = frame.world.bodies[b];
        stresses.push_back(von_mises_stress(elastic, state.x));
        grids.push_back({.mesh = &elastic.rest(),
                         .start = &start_[b],
                         .x = &state.x,
                         .v = &state.v,
                         .contact_force = &frame.contact_forces[b],
                         .von_mises = &stresses.back()});
    }
    vtu_->add_frame(frame.world.time, grids, world_.origin());
}

void SimulationOutputs::add_surfaces(const SimulationFrame& frame) {
    std::vector<TriMesh> surfaces;
    for (std::size_t b = 0; b < start_.size(); ++b) {
        const ContactShape& shape = world_.shape(b);
        surfaces.push_back({embedded(shape.W, frame.world.bodies[b].x), shape.F});
        if (!paths_.obj.empty())
            write_surface(paths_.obj / fmt::format("{}_{:06}.obj", names_[b], frame.number),
                          surfaces.back().X.rowwise() + world_.origin().transpose(), surfaces.back().F);
    }
    if (paths_.picture.empty() || !film_.wants(frame.number)) return;
    film_.add_frame(frame.world.time, std::move(surfaces));
}

void SimulationOutputs::finish(const std::string& failure) {
    for (const int handle : handles_) recording_.end_trajectory(handle, failure, {.troubled = troubled_});
    recording_.finish();
    table_.finish();
    if (reactions_) reactions_->finish();
    if (!paths_.picture.empty()) film_.write(paths_.picture);
}

}  // namespace nbd
