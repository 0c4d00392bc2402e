#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "apps/bench/commands/bench_commands.hpp"
#include "apps/bench/measure/rows.hpp"
#include "apps/cli/load_body.hpp"
#include "apps/cli/option_checks.hpp"
#include "apps/cli/output_paths.hpp"
#include "apps/simulate/film.hpp"
#include "apps/simulate/step_table.hpp"
#include "collision/base/counter_random.hpp"
#include "collision/base/stopwatch.hpp"
#include "sim/factor/blas.hpp"
#include "sim/fem/momentum.hpp"

namespace nbd {
namespace {

struct ContactArguments {
    std::vector<std::string> scenes;
    std::string csv, pictures;
    int seeds = 1;         // runs of each scene; all but the first start with jittered velocities
    double jitter = 0.05;  // largest change of a body's velocity along each axis, m/s
    double seconds = 600;  // a run is stopped after so long
};

/// Compares what contact forces say with what bodies do: the momentum that a body gains in a step against the
/// impulse of gravity and of the contact forces on it. Bodies with grips or pins, or with damping by mass,
/// are left out.
class MomentumBalance {
 public:
    MomentumBalance(const SceneSpec& spec, const World& world) : gravity_(spec.gravity) {
        for (int b = 0; b < world.body_count(); ++b)
            if (spec.bodies[b].grips.empty() && world.elastic(b).material().rayleigh_mass == 0)
                bodies_.push_back({b, momentum_of(world.elastic(b), world.state(b)).linear, 0, 0});
    }

    /// Call after every step of dt seconds.
    void add_step(const World& world, double dt) {
        for (Body& body : bodies_) {
            const ElasticBody& elastic = world.elastic(body.number);
            const Eigen::Vector3d now = momentum_of(elastic, world.state(body.number)).linear;
            const Eigen::Vector3d force =
                world.contact_forces(body.number).colwise().sum().transpose() + elastic.mass() * gravity_;
            const double size = world.state(body.number).v.rowwise().norm().dot(elastic.node_masses());
            body.largest = std::max(body.largest, size);
            body.difference = std::max(body.difference, (now - body.momentum - dt * force).norm());
            body.momentum = now;
        }
    }

    /// Largest difference in a step, as a share of the largest momentum that the body's nodes had; NaN if
    /// there is no body to compare.
    double error() const {
        if (bodies_.empty()) return std::numeric_limits<double>::quiet_NaN();
        double error = 0;
        for (const Body& body : bodies_)
            if (body.largest > 0) error = std::max(error, body.difference / body.largest);
        return error;
    }

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

std::vector<TriMesh> surfaces_of(const World& world) {
    std::vector<TriMesh> surfaces;
    for (int b = 0; b < world.body_count(); ++b) surfaces.push_back({world.surface(b), world.shape(b).F});
    return surfaces;
}

/// The scene with other velocities of its bodies, by at most so much along each axis, m/s.
SceneSpec jittered(SceneSpec spec, int seed, double by) {
    for (std::size_t b = 0; b < spec.bodies.size(); ++b)
        for (int k = 0; k < 3; ++k) spec.bodies[b].velocity[k] += by * (2 * counter_uniform(seed, b, k) - 1);
    return spec;
}

/// Runs a scene, and draws it if a picture is named. The numbers of a row are sums over the steps, extremes,
/// or means of a step where they are times.
nlohmann::ordered_json run_scene(const std::string& name, int seed, const SceneSpec& spec,
                                 std::span<const LoadedBody> bodies, double seconds,
                                 const std::filesystem::path& picture, Output& out) {
    constexpr int stills = 6;
    const int planned = spec.time.frames * spec.time.steps_per_frame;
    StepTable table;
    std::string failure;
    double spent = 0, momentum_error = std::numeric_limits<double>::quiet_NaN();
    long intersecting = 0, faces = 0;
    int worst = 0, cut = 0, most_linearisations = 0;
    try {
        std::vector<StartMove> moves;
        World world = build_world(spec, bodies, &moves);
        for (int b = 0; b < world.body_count(); ++b) faces += world.shape(b).F.rows();
        MomentumBalance momentum(spec, world);
        Film film(spec, world.obstacles(), stills);
        if (!picture.empty()) film.add_frame(0, surfaces_of(world));
        for (int step = 1; step <= planned && failure.empty(); ++step) {
            const Stopwatch watch;
            const WorldReport report = world.step(spec.time.dt);
            spent += watch.seconds();
            failure = report.failure;
            if (!failure.empty()) break;
            const int frame = step / spec.time.steps_per_frame;
            table.add({StepRow{report, frame}});
            cut += report.substeps > 1;
            most_linearisations = std::max(most_linearisations, report.newton_iterations);
            const int found = world.intersecting_faces().size();
            intersecting += found;
            worst = std::max(worst, found);
            momentum.add_step(world, spec.time.dt);
            if (!picture.empty() && step % spec.time.steps_per_frame == 0 && film.wants(frame))
                film.add_frame(world.time(), surfaces_of(world));
            out.progress(fmt::format("{}, seed {}", name, seed), step, planned);
            if (spent > seconds && step < planned) failure = fmt::format("stopped after {:.0f} s", seconds);
        }
        if (!picture.empty()) film.write(picture);
        momentum_error = momentum.error();
    } catch (const std::invalid_argument& error) {
        failure = error.what();
    }
    const StepTotals& total = table.totals();
    const auto ms = [&](double StepReport::*us) { return 1e-3 * total.mean(us); };
    return {{"scene", name},
            {"seed", seed},
            {"bodies", spec.bodies.size()},
            {"faces", faces},
            {"steps", total.steps},
            {"planned", planned},
            {"intersecting", intersecting},
            {"worst", worst},
            {"least_distance", total.all.least_distance},
            {"cut", cut},
            {"troubled", total.troubled_steps},
            {"inverted", total.all.inverted_elements},
            {"momentum_error", momentum_error},
            {"linearisations", total.mean(&StepReport::newton_iterations)},
            {"face_pairs", total.mean(&StepReport::face_pairs)},
            {"ms", 1e3 * spent / std::max(total.steps, 1)},
            {"search_ms", 1e-3 * total.search_us()},
            {"detect_ms", ms(&StepReport::detect_us)},
            {"assemble_ms", ms(&StepReport::assemble_us)},
            {"solve_ms", ms(&StepReport::solve_us)},
            {"rest_ms", ms(&StepReport::rest_us)},
            {"most_linearisations", most_linearisations},
            {"failure", failure}};
}

void run(const ContactArguments& arguments, Output& out) {
    hold_blas_to_one_thread();
    if (!arguments.csv.empty()) check_output(arguments.csv, {}, ".csv");
    if (!arguments.pictures.empty()) make_folder(arguments.pictures);
    Rows rows;
    bool is_broken = false;
    for (const std::string& file : arguments.scenes) {
        SceneSpec spec = load_scene(file);
        std::vector<LoadedBody> bodies = load_bodies(spec, out);
        make_trees(spec, bodies);
        const std::string name = std::filesystem::path(file).stem().string();
        Rows of_scene;
        for (int seed = 0; seed < arguments.seeds; ++seed) {
            std::filesystem::path picture;
            if (seed == 0 && !arguments.pictures.empty())
                picture = std::filesystem::path(arguments.pictures) / (name + ".png");
            of_scene.push_back(run_scene(name, seed, seed > 0 ? jittered(spec, seed, arguments.jitter) : spec,
                                         bodies, arguments.seconds, picture, out));
            is_broken = is_broken || of_scene.back()["intersecting"] > 0;
        }
        out.text(
            to_text(of_scene, {"scene", "seed", "steps", "intersecting", "worst", "least_distance",
                               "troubled", "inverted", "momentum_error", "linearisations", "ms", "failure"}));
        rows.insert(rows.end(), of_scene.begin(), of_scene.end());
    }
    if (!arguments.csv.empty()) write_csv(arguments.csv, rows);
    out.result({{"scenes", rows}});
    if (is_broken) throw std::runtime_error("a step ended with faces that intersect");
}

}  // namespace

void add_bench_contact(CLI::App& app, Output& out) {
    const auto [command, arguments] = add_command<ContactArguments>(
        app, out, "contact", "Runs scenes that are hard for contact, and counts what went wrong", run);
    command.add_option("SCENES", arguments.scenes, "Scene files")->required();
    command.add_option("--seeds", arguments.seeds, "Runs of each scene; all but the first are jittered")
        ->check(whole_number(1, 1000));
    command.add_option("--jitter", arguments.jitter, "Largest change of a body's velocity, m/s")
        ->check(between(0, 1e3));
    command.add_option("--seconds", arguments.seconds, "Time after which a run is stopped")
        ->check(between(1, 1e6));
    command.add_option("--pictures", arguments.pictures,
                       "Folder for pictures of the first run of each, SCENE.png");
    command.add_option("-o,--output", arguments.csv, "Table to write, CSV");
    command.footer(
        "intersecting, worst: pairs of faces that intersect at the ends of steps, in all and in one\n"
        "least_distance: between near features, m; troubled: steps that went wrong\n"
        "momentum_error: the largest in a step, relative; linearisations, ms: of a step\n"
        "Exit status 1 if a step ended with faces that intersect.");
}

}  // namespace nbd
