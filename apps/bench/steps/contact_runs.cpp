#include "apps/bench/steps/contact_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "apps/bench/measure/measure.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/simulate/film.hpp"
#include "collision/base/counter_random.hpp"
#include "collision/base/stopwatch.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

constexpr int stills = 6;

Eigen::Vector3d momentum(const World& world, int body) {
    return world.state(body).v.transpose() * world.elastic(body).node_masses();
}

/// Compares what contact forces say with what bodies do: the momentum that a body gains in a step against the
/// impulse of gravity and of the contact forces on it. Bodies with grips or pins, or with damping by mass,
/// are left out.
class MomentumBalance {
 public:
    MomentumBalance(const SceneSpec& spec, const World& world);

    /// Call after every step of dt seconds.
    void add_step(const World& world, double dt);

    /// Largest difference in a step, as a share of the largest momentum that the body's nodes had.
    double error() const;
    /// Whether there is a body to compare.
    bool applies() const noexcept { return !bodies_.empty(); }

 private:
    struct Body {
        int number;
        Eigen::Vector3d momentum;  // at the end of the last step, kg m/s
        double largest;            // sum over the nodes of mass times speed, kg m/s
        double difference;         // largest of a step, kg m/s
    };
    Eigen::Vector3d gravity_;
    std::vector<Body> bodies_;
};

MomentumBalance::MomentumBalance(const SceneSpec& spec, const World& world) : gravity_(spec.gravity) {
    for (int b = 0; b < world.body_count(); ++b)
        if (spec.bodies[b].grips.empty() && world.elastic(b).material().rayleigh_mass == 0)
            bodies_.push_back({b, momentum(world, b), 0, 0});
}

void MomentumBalance::add_step(const World& world, double dt) {
    for (Body& body : bodies_) {
        const ElasticBody& elastic = world.elastic(body.number);
        const Eigen::Vector3d now = momentum(world, body.number);
        const Eigen::Vector3d force =
            world.contact_forces(body.number).colwise().sum().transpose() + elastic.mass() * gravity_;
        const double size = world.state(body.number).v.rowwise().norm().dot(elastic.node_masses());
        body.largest = std::max(body.largest, size);
        body.difference = std::max(body.difference, (now - body.momentum - dt * force).norm());
        body.momentum = now;
    }
}

double MomentumBalance::error() const {
    double error = 0;
    for (const Body& body : bodies_)
        if (body.largest > 0) error = std::max(error, body.difference / body.largest);
    return error;
}

/// What is a mean over steps.
constexpr double ContactRun::*means[]{
    &ContactRun::linearisations, &ContactRun::contacts,       &ContactRun::face_pairs,  &ContactRun::ms,
    &ContactRun::search_ms,      &ContactRun::detect_ms,      &ContactRun::assemble_ms, &ContactRun::solve_ms,
    &ContactRun::patches,        &ContactRun::patches_proved, &ContactRun::proof_ms};

void jitter(SceneSpec& spec, int seed, double by) {
    for (std::size_t b = 0; b < spec.bodies.size(); ++b)
        for (int k = 0; k < 3; ++k) spec.bodies[b].velocity[k] += by * (2 * counter_uniform(seed, b, k) - 1);
}

std::vector<TriMesh> surfaces_of(const World& world) {
    std::vector<TriMesh> surfaces;
    for (int b = 0; b < world.body_count(); ++b)
        surfaces.push_back({embedded(world.surface(b).W(), world.state(b).x), world.surface(b).F()});
    return surfaces;
}

/// Adds a step that was measured from outside. world: after the step.
void add_step(ContactRun& run, World& world, const WorldReport& report, double ms) {
    ++run.steps;
    const int found = world.intersecting_faces().size();
    run.intersecting += found;
    run.worst = std::max(run.worst, found);
    run.least_distance = std::min(run.least_distance, report.least_distance);
    run.cut += report.substeps > 1;
    run.troubled += report.trouble != StepTrouble::none;
    run.inverted = std::max(run.inverted, report.inverted_elements);
    run.linearisations += report.newton_iterations;
    run.contacts += report.contacts;
    run.face_pairs += report.face_pairs;
    run.patches += report.patches;
    run.patches_proved += report.patches_proved;
    run.proof_ms += report.proof_us / 1e3;
    run.ms += ms;
    run.search_ms += (report.update_us + report.collision_us) / 1e3;
    run.detect_ms += report.detect_us / 1e3;
    run.assemble_ms += report.assemble_us / 1e3;
    run.solve_ms += report.solve_us / 1e3;
}

ContactRun run_once(const SceneSpec& spec, std::span<const LoadedBody> bodies, ContactRun run,
                    const ContactRunConfig& config, Output& out) {
    World world = build_world(spec, bodies);
    run.bodies = world.body_count();
    for (int b = 0; b < world.body_count(); ++b) run.faces += world.surface(b).F().rows();
    run.planned = spec.time.frames * spec.time.steps_per_frame;
    run.least_distance = std::numeric_limits<double>::infinity();
    MomentumBalance momentum(spec, world);
    Film film(spec, world.obstacles(), stills);
    const bool filmed = !config.pictures.empty() && run.seed == 0;
    if (filmed) film.add_frame(0, surfaces_of(world));
    const std::string title = fmt::format("{}, {}, seed {}", run.scene, run.mode, run.seed);
    while (run.steps < run.planned && run.failure.empty()) {
        if (run.ms * 1e-3 > config.seconds) {
            run.failure = fmt::format("stopped after {:.0f} s", config.seconds);
            break;
        }
        const Stopwatch watch;
        const WorldReport report = world.step(spec.time.dt);
        run.failure = report.failure;
        if (!run.failure.empty()) break;
        add_step(run, world, report, watch.microseconds() / 1e3);
        momentum.add_step(world, spec.time.dt);
        const int frame = run.steps / spec.time.steps_per_frame;
        if (filmed && run.steps % spec.time.steps_per_frame == 0 && film.wants(frame))
            film.add_frame(world.time(), surfaces_of(world));
        out.progress(title, run.steps, run.planned);
    }
    if (filmed) film.write(config.pictures / fmt::format("{}_{}.png", run.scene, run.mode));
    run.momentum_error = momentum.applies() ? momentum.error() : std::numeric_limits<double>::quiet_NaN();
    const double steps = std::max(run.steps, 1);
    for (double ContactRun::*mean : means) run.*mean /= steps;
    return run;
}

}  // namespace

std::vector<ContactRun> run_contact_scene(const std::filesystem::path& scene, const ContactRunConfig& config,
                                          Output& out) {
    const SceneSpec spec = load_scene(scene);
    SceneFiles files;
    std::vector<LoadedBody> bodies;
    for (const SceneBody& body : spec.bodies) bodies.push_back(files.load(body, out));
    make_trees(spec, bodies);
    std::vector<ContactRun> runs;
    struct Mode {
        const char* name;
        bool self_contact, intersection_free;
    };
    for (const Mode& mode :
         {Mode{"default", false, false}, Mode{"self", true, false}, Mode{"free", true, true}})
        for (int seed = 0; seed < config.seeds; ++seed) {
            SceneSpec jittered = spec;
            jittered.contact.self_contact = mode.self_contact;
            jittered.contact.intersection_free = mode.intersection_free;
            if (seed > 0) jitter(jittered, seed, config.jitter);
            ContactRun run{.scene = scene.stem().string(), .mode = mode.name, .seed = seed};
            try {
                runs.push_back(run_once(jittered, bodies, run, config, out));
            } catch (const std::invalid_argument& error) {
                run.failure = error.what();
                runs.push_back(run);
            }
        }
    return runs;
}

ContactRun together(std::span<const ContactRun> runs) {
    ContactRun all = runs.front();
    const int count = runs.size();
    for (const ContactRun& run : runs.subspan(1)) {
        all.steps += run.steps;
        all.planned += run.planned;
        all.intersecting += run.intersecting;
        all.worst = std::max(all.worst, run.worst);
        all.least_distance = std::min(all.least_distance, run.least_distance);
        all.cut += run.cut;
        all.troubled += run.troubled;
        all.inverted = std::max(all.inverted, run.inverted);
        all.momentum_error = std::max(all.momentum_error, run.momentum_error);
        for (double ContactRun::*mean : means) all.*mean += run.*mean;
    }
    for (double ContactRun::*mean : means) all.*mean /= count;
    all.seed = count;
    const auto failed =
        std::ranges::count_if(runs, [](const ContactRun& run) { return !run.failure.empty(); });
    all.failure = failed > 0 ? fmt::format("{} of {} ended early", failed, count) : "";
    return all;
}

void write_contact_table(const std::filesystem::path& path, std::span<const ContactRun> runs) {
    h5::AtomicFile file(path);
    file.out() << "# " << this_machine() << '\n'
               << "scene,mode,seed,bodies,faces,steps,planned,intersecting,worst,least_distance,cut,troubled,"
                  "inverted,momentum_error,linearisations,contacts,face_pairs,ms,search_ms,detect_ms,"
                  "assemble_ms,solve_ms,patches,patches_proved,proof_ms,failure\n";
    for (const ContactRun& r : runs)
        file.out() << fmt::format(
            "{},{},{},{},{},{},{},{},{},{:.3g},{},{},{},{:.2g},{:.1f},{:.0f},{:.0f},{:.1f},{:.2f},"
            "{:.2f},{:.2f},{:.2f},{:.0f},{:.0f},{:.2f},\"{}\"\n",
            r.scene, r.mode, r.seed, r.bodies, r.faces, r.steps, r.planned, r.intersecting, r.worst,
            r.least_distance, r.cut, r.troubled, r.inverted, r.momentum_error, r.linearisations, r.contacts,
            r.face_pairs, r.ms, r.search_ms, r.detect_ms, r.assemble_ms, r.solve_ms, r.patches,
            r.patches_proved, r.proof_ms, r.failure);
    file.commit();
}

}  // namespace nbd
