// What the program must say of scenes that go wrong, on standard error.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

#include "apps/bench/physics/physics_check.hpp"
#include "apps/bench/physics/physics_world.hpp"
#include "meshing/formats/write_surface.hpp"
#include "meshing/h5/atomic_file.hpp"

namespace nbd {
namespace {

namespace fs = std::filesystem;

/// The program, from the folder of this one.
fs::path program() {
    const fs::path beside = fs::read_symlink("/proc/self/exe").parent_path() / "nbdtree";
    if (!fs::exists(beside))
        throw std::runtime_error(fmt::format("{}: missing; this check runs it", beside.string()));
    return beside;
}

/// What `nbdtree COMMAND scene.json` prints to standard error.
std::string says(const fs::path& folder, const std::string& command) {
    const std::string line = fmt::format("cd '{}' && '{}' {} --threads 1 2>&1 >/dev/null", folder.string(),
                                         program().string(), command);
    const auto close = [](FILE* file) { return pclose(file); };
    const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(line.c_str(), "r"), close);
    if (!pipe) throw std::runtime_error("a shell cannot be started");
    std::string text;
    char part[4096];
    for (std::size_t n = 0; (n = std::fread(part, 1, sizeof part, pipe.get())) > 0;) text.append(part, n);
    return text;
}

/// A scene of bodies and what else its JSON has. bodies: the inside of each one's braces, beside its surface.
std::string scene_text(const std::string& bodies, const std::string& more, int frames) {
    return fmt::format(R"({{"bodies": [{}]{},
        "time": {{"dt": 0.005, "frames": {}, "steps_per_frame": 1}}}})",
                       bodies, more, frames);
}

std::string body_text(const std::string& surface, double height, double scale, const std::string& material,
                      const std::string& more = "") {
    return fmt::format(R"({{"surface": "{}", "transform": {{"translate": [0, 0, {}], "scale": {}}},
        "material": {{{}}}{}}})",
                       surface, height, scale, material, more);
}

constexpr const char* floor_text = R"(, "obstacles": [{"plane": {"normal": [0, 0, 1]}}])";

/// Whether a line that tells of something has one of these words.
bool tells(const std::string& text, const std::string& word) {
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        const std::string line = text.substr(at, end - at);
        const bool is_told =
            line.find("warning: ") != std::string::npos || line.find("error: ") != std::string::npos;
        if (is_told && line.find("warning: warning:") == std::string::npos &&
            line.find(word) != std::string::npos)
            return true;
        at = end + 1;
    }
    return false;
}

PhysicsOutcome told(bool is_told, std::string text) {
    std::replace(text.begin(), text.end(), '\n', ' ');
    return {.value = is_told ? 1.0 : 0.0,
            .truth = 1,
            .error = is_told ? 0.0 : 1.0,
            .note = is_told ? "" : "said: " + (text.empty() ? "nothing" : text.substr(0, 200))};
}

/// Writes a unit cube and the scene, runs it and looks for the word. command: simulate or validate.
PhysicsOutcome run_scene(const std::string& scene, const std::string& word, const std::string& command,
                         const TriMesh& surface = box_surface({1, 1, 1}, {2, 2, 2})) {
    const h5::ScratchFolder folder;
    write_surface(folder.path() / "body.obj", surface.X, surface.F);
    std::ofstream(folder.path() / "scene.json") << scene;
    const std::string text =
        says(folder.path(), command + " scene.json" + (command == "simulate" ? " -o run.h5" : ""));
    return told(tells(text, word), text);
}

const std::string plain = R"("young": 100000)";

/// variant: where the cube is.
PhysicsOutcome overlap(const PhysicsCase& c) {
    const std::string lower = body_text("body.obj", 0.5 * c.size + 0.05 * c.size, c.size, plain);
    std::string bodies = lower;
    if (c.variant == "in the floor") bodies = body_text("body.obj", 0.4 * c.size, c.size, plain);
    if (c.variant == "half in another") bodies += ", " + body_text("body.obj", 1.05 * c.size, c.size, plain);
    if (c.variant == "inside another")
        bodies += ", " + body_text("body.obj", 0.56 * c.size, 0.3 * c.size, plain);
    return run_scene(scene_text(bodies, floor_text, 1), "resolve_start", "simulate");
}

PhysicsOutcome inversions(const PhysicsCase& c) {
    const double half = 0.5 * c.size;
    const std::string held = fmt::format(
        R"(, "pins": [{{"box": {{"min": [{0}, {0}, {0}], "max": [{1}, {1}, {2}]}}}}], "grips": [{{
            "region": {{"box": {{"min": [{0}, {0}, {3}], "max": [{1}, {1}, {1}]}}}},
            "translate": [0, 0, {4}], "duration": 0.03}}])",
        -1.1 * half, 1.1 * half, -0.9 * half, 0.9 * half, -1.2 * c.size);
    return run_scene(scene_text(body_text("body.obj", 0, c.size, plain, held), "", 10), "inside out",
                     "simulate");
}

const std::string pinned_end = R"(, "pins": [{"box": {"min": [-9, -9, -9], "max": [-0.49, 9, 9]}}])";

PhysicsOutcome one_across(const PhysicsCase& c) {
    return run_scene(scene_text(body_text("body.obj", 0, 1, plain, pinned_end), "", 1),
                     "one linear tetrahedron thick", c.variant, box_surface({1, 0.1, 0.1}, {1, 1, 1}));
}

PhysicsOutcome locking(const PhysicsCase& c) {
    const std::string rubber = fmt::format(R"("young": 100000, "poisson": {})", c.parameter);
    return run_scene(scene_text(body_text("body.obj", 0, 1, rubber, pinned_end), "", 1), "Poisson",
                     c.variant);
}

PhysicsOutcome large(const PhysicsCase& c) {
    return run_scene(scene_text(body_text("body.obj", 0, c.size, plain), "", 1), "--scale", c.variant);
}

std::vector<PhysicsCase> all_quick(PhysicsRange range) {
    range.steps = {5e-3};
    range.moduli = {1e5};
    range.far = FarBody::none;
    return all_cases(range, 1);
}

}  // namespace

std::vector<PhysicsCheck> told_checks() {
    const std::vector<std::string> commands{"simulate", "validate"};
    const char* const answer = "1 if told";
    return {{"told_overlap",
             "A start that overlaps is told by `simulate`, with `resolve_start` as the way out.", answer, 0,
             all_quick({.sizes = {0.1}, .variants = {"in the floor", "half in another", "inside another"}}),
             overlap},
            {"told_inversions", "Tetrahedra that end inside out are told with their number.", answer, 0,
             all_quick({.sizes = {0.1}}), inversions},
            {"told_one_across", "A bar of one tetrahedron across that bends is told.", answer, 0,
             all_quick({.sizes = {1}, .variants = commands}), one_across},
            {"told_locking", "A Poisson's ratio at which elements lock is told.", answer, 0,
             all_quick({.sizes = {1}, .variants = commands, .parameters = {0.49, 0.499}}), locking,
             "Poisson's ratio"},
            {"told_size", "A body of 100 m, where millimetres may be meant, is told.", answer, 0,
             all_quick({.sizes = {100}, .variants = commands}), large}};
}

}  // namespace nbd
