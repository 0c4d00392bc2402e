#include "tests/sim/calculix/calculix.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "meshing/surface/quadratic_tets.hpp"
#include "sim/fem/elastic_body.hpp"
#include "sim/fem/modes.hpp"
#include "tests/sim/support/one_body_world.hpp"
#include "tests/support/box_mesh.hpp"
#include "tests/support/temporary_folder.hpp"

namespace nbd::test {
namespace {

// Nodes, elements and material as CalculiX input, which allows at most 20 characters per number.
std::string model(const ElasticBody& body, double density_scale = 1) {
    const TetMesh& mesh = body.rest();
    const Material& material = body.material();
    std::string text = "*NODE, NSET=ALL\n";
    const auto out = std::back_inserter(text);
    for (Eigen::Index i = 0; i < mesh.X.rows(); ++i)
        fmt::format_to(out, "{}, {:.12g}, {:.12g}, {:.12g}\n", i + 1, mesh.X(i, 0), mesh.X(i, 1),
                       mesh.X(i, 2));
    text += fmt::format("*ELEMENT, TYPE={}, ELSET=BODY\n", mesh.is_quadratic() ? "C3D10" : "C3D4");
    for (Eigen::Index t = 0; t < mesh.T.rows(); ++t) {
        fmt::format_to(out, "{}", t + 1);
        for (const int node : mesh.T.row(t)) fmt::format_to(out, ", {}", node + 1);
        if (mesh.is_quadratic())
            for (const int k : {0, 3, 1, 2, 4, 5}) fmt::format_to(out, ", {}", mesh.E(t, k) + 1);
        text += '\n';
    }
    fmt::format_to(out, "*MATERIAL, NAME=ELASTIC\n*ELASTIC\n{:.12g}, {:.12g}\n*DENSITY\n{:.12g}\n",
                   material.young, material.poisson, density_scale * material.density);
    text += "*SOLID SECTION, ELSET=BODY, MATERIAL=ELASTIC\n";
    return text;
}

// The nodes' masses as one-node elements.
std::string point_masses(const ElasticBody& body) {
    std::string text;
    for (int i = 0; i < body.node_count(); ++i)
        fmt::format_to(std::back_inserter(text),
                       "*ELEMENT, TYPE=MASS, ELSET=M{0}\n{1}, {0}\n*MASS, ELSET=M{0}\n{2:.12g}\n", i + 1,
                       body.element_count() + i + 1, body.node_masses()[i]);
    return text;
}

std::string read_text(const std::filesystem::path& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
}

// Runs CalculiX and returns its .dat file.
std::string run_calculix(const std::string& input) {
    const TemporaryFolder folder;
    folder.write("job.inp", input);
    const std::string command =
        fmt::format("cd '{}' && OMP_NUM_THREADS=1 ccx job > log 2>&1", folder.path().string());
    const int status = std::system(command.c_str());
    const std::string log = read_text(folder / "log");
    if (const auto error = log.find("*ERROR"); status != 0 || error != std::string::npos)
        throw std::runtime_error(fmt::format("ccx ended with status {}: {}", status,
                                             log.substr(std::min(error, log.size()), 300)));
    return read_text(folder / "job.dat");
}

// Text after the last occurrence of `title`. Throws std::runtime_error if there is none.
std::istringstream after(const std::string& text, const std::string& title) {
    const auto at = text.rfind(title);
    if (at == std::string::npos) throw std::runtime_error("ccx wrote no \"" + title + "\"");
    return std::istringstream(text.substr(at + title.size()));
}

/// Values of a field in the middle of edges, which are the degrees of freedom of C3D10. nodes: those of
/// control points.
Nodes at_middles(const TetMesh& mesh, Nodes nodes) {
    const Nodes given = nodes;
    for (Eigen::Index t = 0; t < mesh.E.rows(); ++t)
        for (int k = 0; k < 6; ++k) {
            const auto [a, b] = edges_of_tet[k];
            const int node = mesh.E(t, k);
            nodes.row(node) = given.row(node) / 2 + (given.row(mesh.T(t, a)) + given.row(mesh.T(t, b))) / 4;
        }
    return nodes;
}

/// The lowest `count` elastic frequencies of the free body (no rigid modes), Hz, ascending. C3D4 integrates
/// its mass at one point, so point masses on the nodes take its place. Throws std::runtime_error with
/// CalculiX's first error message; so does calculix_displacements.
Eigen::VectorXd calculix_frequencies(const ElasticBody& body, int count) {
    constexpr int rigid = 6;
    std::string input = body.rest().is_quadratic() ? model(body) : model(body, 1e-12) + point_masses(body);
    input += fmt::format("*STEP\n*FREQUENCY\n{}\n*END STEP\n", count + rigid);
    const std::string dat = run_calculix(input);
    std::istringstream table = after(dat, "(RAD/TIME)      (CYCLES/TIME     (RAD/TIME)");
    Eigen::VectorXd hertz(count);
    for (int row = 0; row < count + rigid; ++row) {
        int mode = 0;
        double eigenvalue = 0, omega = 0, cycles = 0, imaginary = 0;
        if (!(table >> mode >> eigenvalue >> omega >> cycles >> imaginary) || mode != row + 1)
            throw std::runtime_error(fmt::format("ccx wrote {} of {} frequencies", row, count + rigid));
        if (row >= rigid) hertz[row - rigid] = cycles;
    }
    return hertz;
}

/// The same of ours, with the mass of C3D10, which CalculiX integrates by the four points of its stiffness.
/// That is exact for polynomials of degree two, and products of shape functions have four.
Eigen::VectorXd frequencies_with_mass_of_four_points(const ElasticBody& body, int count) {
    const TetMesh& mesh = body.rest();
    const ElementNodes of_tets = nodes_of_tets(mesh);
    Eigen::MatrixXd M = Eigen::MatrixXd::Zero(body.unknown_count(), body.unknown_count());
    for (Eigen::Index t = 0; t < of_tets.rows(); ++t)
        for (int p = 0; p < 4; ++p) {
            Eigen::Vector4d z = Eigen::Vector4d::Constant((5 - std::sqrt(5)) / 20);
            z[p] = (5 + 3 * std::sqrt(5)) / 20;
            Eigen::Vector<double, 10> shapes;
            shapes.head<4>() = z.cwiseAbs2();
            for (int k = 0; k < 6; ++k)
                shapes[4 + k] = 2 * z[edges_of_tet[k].first] * z[edges_of_tet[k].second];
            const double mass = body.material().density * body.rest_volumes()[t] / 4;
            for (int a = 0; a < 10; ++a)
                for (int b = 0; b < 10; ++b)
                    M.block<3, 3>(3 * of_tets(t, a), 3 * of_tets(t, b)).diagonal().array() +=
                        mass * shapes[a] * shapes[b];
        }
    // Some motions have no mass at the points, so the other matrix has to be the positive definite one.
    const Eigen::MatrixXd K = body.rest_stiffness();
    const double shift = K.diagonal().minCoeff() / M.diagonal().maxCoeff();
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(M, K + shift * M,
                                                                           Eigen::EigenvaluesOnly);
    const Eigen::VectorXd squares = solver.eigenvalues().cwiseInverse().array() - shift;  // descending
    return squares.reverse().segment(6, count).cwiseSqrt() / (2 * std::numbers::pi);
}

/// A body with fixed nodes and loads.
struct StaticCase {
    std::vector<int> held;                              // fixed nodes
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();  // m/s2
    int pulled = 0;                                     // node that `pull` acts on
    Eigen::Vector3d pull = Eigen::Vector3d::Zero();     // newtons
    std::vector<int> moved{};                           // other nodes, which go on by `way`, metres
    Eigen::Vector3d way = Eigen::Vector3d::Zero();
};

/// Static displacements of the nodes under the loads, [N, 3], metres. `large`: uses Green strains for large
/// displacements (NLGEOM) instead of linear strains.
Nodes calculix_displacements(const ElasticBody& body, const StaticCase& load, bool large = false) {
    std::string input = model(body) + "*BOUNDARY\n";
    const auto out = std::back_inserter(input);
    for (const int node : load.held) fmt::format_to(out, "{}, 1, 3\n", node + 1);
    input += large ? "*STEP, NLGEOM, INC=1000\n*STATIC\n0.1, 1\n" : "*STEP\n*STATIC\n";
    if (const double g = load.gravity.norm(); g > 0) {
        const Eigen::Vector3d down = load.gravity / g;
        fmt::format_to(out, "*DLOAD\nBODY, GRAV, {:.12g}, {:.12g}, {:.12g}, {:.12g}\n", g, down[0], down[1],
                       down[2]);
    }
    for (int c = 0; c < 3; ++c)
        if (load.pull[c] != 0)
            fmt::format_to(out, "*CLOAD\n{}, {}, {:.12g}\n", load.pulled + 1, c + 1, load.pull[c]);
    if (!load.moved.empty()) input += "*BOUNDARY\n";
    for (const int node : load.moved)
        for (int c = 0; c < 3; ++c)
            fmt::format_to(out, "{}, {}, {}, {:.12g}\n", node + 1, c + 1, c + 1, load.way[c]);
    input += "*NODE PRINT, NSET=ALL\nU\n*END STEP\n";

    std::istringstream table = after(run_calculix(input), "for set ALL and time  0.1000000E+01");
    Nodes u(body.node_count(), 3);
    for (Eigen::Index i = 0; i < u.rows(); ++i) {
        int node = 0;
        if (!(table >> node >> u(i, 0) >> u(i, 1) >> u(i, 2)) || node != i + 1)
            throw std::runtime_error(fmt::format("ccx wrote {} of {} displacements", i, u.rows()));
    }
    return u;
}

/// The same by static increments.
Nodes balanced(const ElasticBody& elastic, const StaticCase& load, int increments) {
    WorldConfig config{.gravity = load.gravity};
    config.limits.stretch = std::numeric_limits<double>::infinity();
    config.statics = StaticConfig{.tolerance = 1e-8};
    std::vector<Grip> grips{{.nodes = load.held}};
    if (!load.moved.empty())
        grips.push_back({.nodes = load.moved, .motion = eased({.translation = load.way, .duration = 1})});
    OneBodyWorld world(elastic, config, {}, std::move(grips));
    world.steps(increments, 1.0 / increments);
    return world.state().x - elastic.rest().X;
}

Comparison compare_balance(const std::string& quantity, const ElasticBody& elastic, const StaticCase& load) {
    const Nodes ours = at_middles(elastic.rest(), balanced(elastic, load, 5));
    const Nodes theirs = calculix_displacements(elastic, load, true);
    const double largest = theirs.rowwise().norm().maxCoeff();
    return {quantity, ours.rowwise().norm().maxCoeff(), largest,
            (ours - theirs).rowwise().norm().maxCoeff() / largest, elastic.node_count()};
}

// A body clamped at the low end of its longest side and loaded across it.
struct Clamped {
    ElasticBody elastic;
    Eigen::Index along = 0, across = 0;
    double length = 0;
    std::vector<int> held;

    explicit Clamped(const Body& body) : elastic(body.tets, undamped(body.material)) {
        const Nodes& X = body.tets.X;
        const Eigen::RowVector3d low = X.colwise().minCoeff(), size = X.colwise().maxCoeff() - low;
        length = size.maxCoeff(&along);
        size.minCoeff(&across);
        held = nodes_where(X, [&](const auto& p) { return p[along] < low[along] + 0.1 * length; });
        // A node of an edge is held where both ends are: only then the edge is, in both programs.
        std::vector<char> is_held(X.rows(), 0), is_free(X.rows(), 0);
        for (const int node : held) is_held[node] = 1;
        const TetMesh& mesh = body.tets;
        for (Eigen::Index t = 0; t < mesh.E.rows(); ++t)
            for (int k = 0; k < 6; ++k) {
                const auto [a, b] = edges_of_tet[k];
                if (!is_held[mesh.T(t, a)] || !is_held[mesh.T(t, b)]) is_free[mesh.E(t, k)] = 1;
            }
        std::erase_if(held, [&](int node) { return is_free[node] != 0; });
    }
    static Material undamped(Material material) {
        material.rayleigh_mass = material.rayleigh_stiffness = 0;
        return material;
    }

    StaticCase weight(double g) const {
        StaticCase load{.held = held};
        load.gravity[across] = -g;
        return load;
    }
    StaticCase pull(double newtons) const {
        StaticCase load{.held = held};
        Eigen::Index node = 0;
        elastic.rest().X.col(along).maxCoeff(&node);
        load.pulled = node;
        load.pull[across] = newtons;
        return load;
    }
    Nodes displacements(const StaticCase& load, int load_steps = 1, int newton_iterations = 1) const {
        Loads loads{.gravity = load.gravity, .forces = Nodes::Zero(elastic.node_count(), 3)};
        loads.forces.row(load.pulled) = load.pull.transpose();
        return static_displacements(elastic, held, loads, {}, load_steps, newton_iterations);
    }
    Comparison compare(const StaticCase& load, const std::string& quantity) const {
        const Nodes ours = at_middles(elastic.rest(), displacements(load));
        const Nodes theirs = calculix_displacements(elastic, load);
        const double largest = theirs.rowwise().norm().maxCoeff();
        return {quantity, ours.rowwise().norm().maxCoeff(), largest,
                (ours - theirs).rowwise().norm().maxCoeff() / largest};
    }
};

}  // namespace

std::vector<Comparison> compare_frequencies(const Body& body, int count) {
    std::vector<Comparison> rows;
    const ElasticBody elastic(body.tets, body.material);
    const Eigen::VectorXd ours = body.tets.is_quadratic()
                                     ? frequencies_with_mass_of_four_points(elastic, count)
                                     : vibration_modes(elastic, {.count = count}).basis.frequencies;
    const Eigen::VectorXd theirs = calculix_frequencies(elastic, count);
    for (int i = 0; i < count; ++i)
        rows.push_back({fmt::format("frequency {} with {} [Hz]", i + 1,
                                    body.tets.is_quadratic() ? "mass by four points" : "lumped mass"),
                        ours[i], theirs[i], std::abs(ours[i] / theirs[i] - 1)});
    return rows;
}

std::vector<Comparison> compare_deflections(const Body& body) {
    const Clamped clamped(body);
    const double g = 1e-3;
    return {clamped.compare(clamped.weight(g), "deflection under weight [m]"),
            clamped.compare(clamped.pull(g * clamped.elastic.mass()), "deflection under a pull [m]")};
}

Comparison compare_large_deflection(const Body& body, MaterialLaw law, double share) {
    Body of_law = body;
    of_law.material.law = law;
    const Clamped clamped(of_law);
    const double unit = clamped.displacements(clamped.weight(1)).rowwise().norm().maxCoeff();
    const StaticCase load = clamped.weight(share * clamped.length / unit);
    const Nodes ours = at_middles(body.tets, clamped.displacements(load, 10, 30));
    const Nodes theirs = calculix_displacements(clamped.elastic, load, true);
    const double largest = theirs.rowwise().norm().maxCoeff();
    return {fmt::format("large deflection under weight ({}) [m]", name(law)),
            ours.rowwise().norm().maxCoeff(), largest, (ours - theirs).rowwise().norm().maxCoeff() / largest};
}

std::vector<Comparison> compare_static_increments() {
    Material rubber{.young = 2e5, .poisson = 0.3, .rayleigh_mass = 0, .rayleigh_stiffness = 0};
    rubber.law = MaterialLaw::st_venant_kirchhoff;
    const auto body = [&](const Eigen::Vector3d& size, const Eigen::Vector3i& cells) {
        return ElasticBody(make_quadratic(box_mesh(size, cells)), rubber);
    };
    const auto where = [](const ElasticBody& elastic, const auto& test) {
        return nodes_where(elastic.rest().X, test);
    };
    constexpr double near = 1e-9;
    const ElasticBody beam = body({1, 0.1, 0.1}, {16, 2, 2});
    const StaticCase bent{.held = where(beam, [](const auto& p) { return p[0] < near; }),
                          .gravity = {0, 0, -0.5}};
    const ElasticBody plate = body({1, 1, 0.05}, {10, 10, 1});
    const StaticCase sagging{.held = where(plate,
                                           [](const auto& p) {
                                               return p.template head<2>().minCoeff() < near ||
                                                      p.template head<2>().maxCoeff() > 1 - near;
                                           }),
                             .gravity = {0, 0, -2}};
    const ElasticBody block = body({1, 1, 0.5}, {6, 6, 4});
    const StaticCase pressed{.held = where(block, [](const auto& p) { return p[2] < near; }),
                             .moved = where(block, [](const auto& p) { return p[2] > 0.5 - near; }),
                             .way = {0, 0, -0.05}};
    return {compare_balance("static cantilever under its weight [m]", beam, bent),
            compare_balance("static plate clamped at its edges [m]", plate, sagging),
            compare_balance("static block pressed by a tenth [m]", block, pressed)};
}

bool calculix_installed() { return std::system("command -v ccx > /dev/null 2>&1") == 0; }

}  // namespace nbd::test
