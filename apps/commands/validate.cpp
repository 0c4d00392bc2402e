#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <set>
#include <stdexcept>
#include <vector>

#include "apps/cli/load_body.hpp"
#include "apps/commands/commands.hpp"
#include "collision/base/file_text.hpp"
#include "sim/scene/scene_check.hpp"
#include "sim/scene/scene_template.hpp"

namespace nbd {
namespace {

/// Everything that is wrong with a scene or may be, one line each.
SceneFindings findings_of(SceneReading reading, SceneFiles& files) {
    SceneFindings findings{reading.problems, {}, {}};
    Output silent;
    silent.quiet = true;
    std::vector<LoadedBody> loaded(reading.spec.bodies.size());
    for (std::size_t b = 0; b < loaded.size(); ++b) {
        if (!reading.body_is_good[b]) continue;
        try {
            loaded[b] = files.load(reading.spec.bodies[b], silent);
        } catch (const std::exception& error) {
            findings.problems.push_back(fmt::format("bodies[{}]: {}", b, error.what()));
        }
    }
    try {
        files.load_recordings(reading.spec);
    } catch (const std::exception& error) {
        findings.problems.emplace_back(error.what());
        for (std::size_t o = 0; o < reading.spec.obstacles.size(); ++o)
            if (reading.spec.obstacles[o].recording && !reading.spec.obstacles[o].frames)
                reading.obstacle_is_good[o] = false;
    }
    SceneFindings checked = check_scene(reading, loaded);
    std::ranges::move(checked.problems, std::back_inserter(findings.problems));
    findings.warnings = std::move(checked.warnings);
    findings.notes = std::move(checked.notes);
    findings.start_problems = checked.start_problems;
    return findings;
}

/// Findings of a scene with variables: of the ends of their ranges and of some trajectories. What intersects
/// at the start is a problem if it does in all of these, since datasets draw such values again.
class TemplateCheck {
 public:
    TemplateCheck(const std::string& text, const std::filesystem::path& base)
        : scene_(text, base, findings_.problems) {}

    SceneFindings run() {
        if (!findings_.problems.empty()) return std::move(findings_);
        for (const SceneValues& values : scene_.extremes(seed)) check(values);
        std::string first;
        int intersecting = 0;
        for (int trajectory = 0; trajectory < drawn; ++trajectory) {
            const std::string start = check(scene_.draw(seed, trajectory));
            if (first.empty() && !start.empty()) first = fmt::format("trajectory {}: {}", trajectory, start);
            intersecting += start.empty() ? 0 : 1;
        }
        if (intersecting == drawn)
            findings_.problems.push_back(
                fmt::format("the start intersects in all of {} trajectories, the first is {}", drawn, first));
        else if (intersecting > 0)
            findings_.warnings.push_back(fmt::format(
                "the start intersects in {} of {} trajectories, whose values are drawn again, the first "
                "is {}",
                intersecting, drawn, first));
        return std::move(findings_);
    }

 private:
    static constexpr int drawn = 4;
    static constexpr std::uint64_t seed = 1;

    /// Each line once, whatever numbers it has, with the first values that it came with.
    void add(const std::vector<std::string>& lines, const SceneValues& values, std::vector<std::string>& to) {
        for (const std::string& line : lines) {
            const std::size_t path = std::min(line.find(": "), line.size());
            std::string what = line.substr(path);
            std::erase_if(what, [](unsigned char c) { return std::isdigit(c) != 0 || c == '.'; });
            if (told_.insert(line.substr(0, path) + what).second)
                to.push_back(
                    fmt::format("{} (with {})", line.substr(0, line.find('\n')), values_text(values)));
        }
    }

    /// Returns what intersects at the start; empty if nothing does.
    std::string check(const SceneValues& values) {
        SceneFindings found = findings_of(read_scene(scene_.text_with(values), scene_.base()), files_);
        std::string start;
        if (found.start_problems > 0) {
            const std::size_t others = found.problems.size() - found.start_problems;
            start = fmt::format("{} (with {})", found.problems[others], values_text(values));
            found.problems.resize(others);
        }
        add(found.problems, values, findings_.problems);
        add(found.warnings, values, findings_.warnings);
        add(found.notes, values, findings_.notes);
        return start;
    }

    SceneFindings findings_;
    SceneTemplate scene_;
    SceneFiles files_;
    std::set<std::string> told_;
};

SceneFindings findings_of(const std::filesystem::path& path) {
    SceneFindings findings;
    try {
        const std::string text = file_text(path);
        SceneFiles files;
        findings = is_template(text) ? TemplateCheck(text, path.parent_path()).run()
                                     : findings_of(read_scene(text, path.parent_path()), files);
    } catch (const std::invalid_argument& error) {
        return {{fmt::format("{}: {}", path.string(), error.what())}, {}, {}};
    } catch (const std::runtime_error& error) {
        return {{error.what()}, {}, {}};  // the message names the path
    }
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
        const SceneFindings findings = findings_of(scene);
        const std::vector<std::string>& problems = findings.problems;
        for (const std::string& note : findings.notes) out.announcement(note);
        for (const std::string& warning : findings.warnings) out.warning(warning);
        count += problems.size();
        wrong += problems.empty() ? 0 : 1;
        if (problems.empty()) out.text(scene + ": valid");
        for (const std::string& problem : problems) out.quiet ? out.warning(problem) : out.text(problem);
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
        "Checks scenes without running them; prints all problems and warnings, one per line. Of scenes with "
        "variables, it checks the ends of their ranges and some trajectories",
        run);
    command.add_option("SCENE", scenes, "Scene files, JSON")->required();
}

}  // namespace nbd
