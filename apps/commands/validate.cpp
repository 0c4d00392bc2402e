#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <stdexcept>
#include <vector>

#include "apps/cli/load_body.hpp"
#include "apps/commands/commands.hpp"
#include "collision/base/file_text.hpp"
#include "sim/scene/scene_check.hpp"

namespace nbd {
namespace {

/// Everything that is wrong with a scene or may be, one line each.
SceneFindings findings_of(const std::filesystem::path& path) {
    SceneReading reading;
    try {
        reading = read_scene(file_text(path), path.parent_path());
    } catch (const std::invalid_argument& error) {
        return {{fmt::format("{}: {}", path.string(), error.what())}, {}, {}};
    } catch (const std::runtime_error& error) {
        return {{error.what()}, {}, {}};  // the message names the path
    }
    SceneFindings findings{reading.problems, {}, {}};
    Output silent;
    silent.quiet = true;
    SceneFiles files;
    std::vector<LoadedBody> loaded(reading.spec.bodies.size());
    for (std::size_t b = 0; b < loaded.size(); ++b) {
        if (!reading.body_is_good[b]) continue;
        try {
            loaded[b] = files.load(reading.spec.bodies[b], silent);
        } catch (const std::exception& error) {
            findings.problems.push_back(fmt::format("bodies[{}]: {}", b, error.what()));
        }
    }
    SceneFindings checked = check_scene(reading, loaded);
    std::ranges::move(checked.problems, std::back_inserter(findings.problems));
    findings.warnings = std::move(checked.warnings);
    findings.notes = std::move(checked.notes);
    for (auto* lines : {&findings.problems, &findings.warnings, &findings.notes})
        for (std::string& line : *lines)
            line = fmt::format("{}: {}", path.string(), line.substr(0, line.find('\n')));
    return findings;
}

void run(const std::vector<std::string>& scenes, Output& out) {
    nlohmann::ordered_json result = nlohmann::ordered_json::array();
    std::size_t count = 0, wrong = 0;
    for (const std::string& scene : scenes) {
        out.work("checking " + scene);
        const auto [problems, warnings, notes] = findings_of(scene);
        for (const std::string& note : notes) out.announcement(note);
        for (const std::string& warning : warnings) out.warning(warning);
        count += problems.size();
        wrong += problems.empty() ? 0 : 1;
        if (problems.empty()) out.text(scene + ": valid");
        for (const std::string& problem : problems) out.text(problem);
        result.push_back({{"scene", scene}, {"problems", problems}});
    }
    out.result({{"scenes", result}});
    if (count > 0)
        throw std::runtime_error(fmt::format("{} problem{} in {} of {} scene{}", count, count == 1 ? "" : "s",
                                             wrong, scenes.size(), scenes.size() == 1 ? "" : "s"));
}

}  // namespace

void add_validate(CLI::App& app, Output& out) {
    const auto [command, scenes] = add_command<std::vector<std::string>>(
        app, out, "validate",
        "Checks scenes without running them; prints all problems and warnings, one per line", run);
    command.add_option("SCENE", scenes, "Scene files, JSON")->required();
}

}  // namespace nbd
